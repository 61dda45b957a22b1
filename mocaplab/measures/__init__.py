"""Error measures in parts; :mod:`mocaplab.measures.by_name` has all of them by name."""
