"""Write which clips to train on and which to test on (:mod:`mocaplab.splits`).

python -m data_tools.splits embedded -o splits.json
python -m data_tools.splits cmu --seed 1 -o splits.json     a folder with clips.csv
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence

from mocaplab.files import write_atomically
from mocaplab.splits import Split, make_splits, read_clip_list


def read_clips(source: str) -> tuple[list[str], list[str], list[int] | None]:
    """Read names, actions and, where known, subjects of a collection.

    Parameters
    ----------
    source : "embedded", "catalogue" (the CMU trials of paper A's mix), or a folder with a
        ``clips.csv`` that has the columns clip and action and may have subject

    Raises
    ------
    ValueError, OSError
    """
    if source == "embedded":
        from mocaplab.datasets import load_dataset

        dataset = load_dataset("embedded")
        return [clip.name for clip in dataset.clips], list(dataset.actions), None
    if source == "catalogue":
        from data_tools.catalogue import choose, load_catalogue

        trials = choose(load_catalogue())
        names, actions = [t.clip for t in trials], [t.action for t in trials]
        return names, actions, [t.subject for t in trials]
    return read_clip_list(source)


def splits_to_json(
    names: Sequence[str], actions: Sequence[str], subjects: Sequence[int] | None, seed: int
) -> str:
    """Make all splits of a collection and write them as JSON, by clip name."""

    def named(split: Split) -> dict[str, list[str]]:
        return {"train": [names[i] for i in split.train], "test": [names[i] for i in split.test]}

    paper = make_splits("paper", actions, seed=seed)
    splits: dict[str, object] = {"seed": seed, "paper": [named(s) for s in paper.values()]}
    if subjects is not None:
        strict = make_splits("subject", actions, subjects, seed=seed)
        splits["by_subject"] = [named(split) for split in strict.values()]
    out = make_splits("action", actions, seed=seed)
    splits["leave_one_action_out"] = {
        name.removeprefix("without_"): named(split) for name, split in out.items()
    }
    return json.dumps(splits, indent=1) + "\n"


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the splits of a collection: 0 done, 2 refused."""
    parser = argparse.ArgumentParser(
        prog="python -m data_tools.splits",
        description="Write the paper's holdouts, stricter ones, and leave-one-action-out.",
    )
    parser.add_argument("source", help="embedded, catalogue, or a folder with clips.csv")
    parser.add_argument("-o", "--output", required=True, metavar="OUT.json")
    parser.add_argument("--seed", type=int, default=0, help="default: 0")
    options = parser.parse_args(arguments)
    try:
        names, actions, subjects = read_clips(options.source)
        write_atomically(options.output, splits_to_json(names, actions, subjects, options.seed))
    except (ValueError, OSError) as error:
        print(f"data_tools.splits: error: {error}", file=sys.stderr)
        return 2
    note = "; no subjects are known, so none by subject" if subjects is None else ""
    print(f"wrote {options.output}{note}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
