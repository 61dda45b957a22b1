"""What :mod:`mocaplab.cleaning` is built from: pieces, frame rates, files, folders, reports."""
