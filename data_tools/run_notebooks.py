"""Run the notebooks and store them with their outputs, ready to commit.

    python -m data_tools.run_notebooks            all of them
    python -m data_tools.run_notebooks 00 07      those whose names begin so

A stored notebook must read well without a kernel. So the state of widgets is not kept;
what shows instead is each widget's own HTML, which plays by itself.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

from mocaplab.files import write_atomically

FOLDER = Path(__file__).parent.parent / "notebooks"
WIDGET = "application/vnd.jupyter.widget-view+json"


def run(path: Path) -> float:
    """Run one notebook, store it, and return the seconds that it took."""
    notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
    start = time.perf_counter()
    NotebookClient(
        notebook,
        timeout=300,
        store_widget_state=False,
        coalesce_streams=True,
        resources={"metadata": {"path": str(path.parent)}},
    ).execute()
    seconds = time.perf_counter() - start
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # the times of this run are news to nobody
        for output in cell.get("outputs", []):
            drop_widget_view(output.get("data", {}))
    text: str = nbformat.writes(notebook)  # type: ignore[no-untyped-call]
    write_atomically(path, text + "\n")
    return seconds


def drop_widget_view(data: dict[str, Any]) -> None:
    """Leave the HTML of a widget alone: without a kernel the widget shows an error."""
    if "text/html" in data:
        data.pop(WIDGET, None)


def main() -> None:
    """Run the notebooks that the command line names."""
    parser = argparse.ArgumentParser(
        description=(__doc__ or "").splitlines()[0],
        epilog="example: python -m data_tools.run_notebooks 00",
    )
    parser.add_argument("names", nargs="*", help="beginnings of file names (default: all)")
    names = tuple(parser.parse_args().names)
    for path in sorted(FOLDER.glob("*.ipynb")):
        if not names or path.name.startswith(names):
            print(f"{path.name}: {run(path):.0f} s, {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
