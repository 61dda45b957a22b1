"""What :mod:`mocaplab.training` is built from: batches, lessons, state, several processes."""
