"""Keep the results of a reproduction with the package, for notebook 10 to read.

python -m data_tools.store_reproduction FOLDER

``FOLDER`` is the output folder of ``mocaplab reproduce``. Only errors and verdicts are kept, no
motion. After it, run and store notebook 10 again: python -m data_tools.run_notebooks 10
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from mocaplab.files import write_atomically
from mocaplab.reproduction.stored import STORED, read_table

TARGET = Path(__file__).parent.parent / "mocaplab" / "data" / "reproduction"
LARGEST = 100_000  # bytes, of all tables together


def store(folder: Path, target: Path) -> list[str]:
    """Copy the tables that a run has, and take those away that it has not.

    Raises
    ------
    ValueError
        If there are no claims, a table is none, or they are too large to be kept.
    """
    texts = {
        name: (folder / f"{name}.csv").read_text(encoding="utf-8")
        for name in STORED
        if (folder / f"{name}.csv").is_file()
    }
    if "claims" not in texts:
        raise ValueError(f"{folder} has no claims.csv; is it a folder of mocaplab reproduce?")
    for text in texts.values():
        read_table(text)
    size = sum(len(text.encode()) for text in texts.values())
    if size > LARGEST:
        raise ValueError(f"expected at most {LARGEST} bytes of tables, got {size} in {folder}")
    target.mkdir(parents=True, exist_ok=True)
    for name in STORED:
        if name in texts:
            write_atomically(target / f"{name}.csv", texts[name])
        else:
            (target / f"{name}.csv").unlink(missing_ok=True)
    return list(texts)


def main(arguments: Sequence[str] | None = None) -> int:
    """Store a run and say what was kept."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path, help="output folder of mocaplab reproduce")
    options = parser.parse_args(arguments)
    try:
        names = store(options.folder, TARGET)
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"stored {', '.join(names)} in {TARGET}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
