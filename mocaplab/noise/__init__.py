"""What :mod:`mocaplab.corruption` joins: noise, gaps, and faults of real captures."""
