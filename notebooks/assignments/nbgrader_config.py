"""The course, as nbgrader reads it; run nbgrader in this folder. See README.md."""

import os

c = get_config()  # noqa: F821  (nbgrader defines it)

c.CourseDirectory.course_id = "mocaplab"
c.CourseDirectory.root = os.path.dirname(os.path.abspath(__file__))

# What stands where a solution was. It raises no error, so that "Run All" gets to the end.
c.ClearSolutions.code_stub = {"python": "# your code here\npass"}
c.ClearSolutions.text_stub = "Your answer here."

# Endless loops are stopped after this many seconds in one cell; the cell gets no points.
c.Execute.timeout = 90
# A check that a student deleted comes back. Without this line it would silently count as zero.
c.OverwriteCells.add_missing_cells = True
# A hint is short; what a student prints may not be.
c.LimitOutput.max_lines = 200
