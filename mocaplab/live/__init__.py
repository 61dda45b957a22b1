"""What :mod:`mocaplab.streaming` runs: filters and networks that take one frame at a time."""
