"""Lets ``python -m mocaplab`` do what ``mocaplab`` does."""

import sys

from mocaplab.cli import main

sys.exit(main())
