"""What the commands of the command line do; :mod:`mocaplab.cli` reads their options."""
