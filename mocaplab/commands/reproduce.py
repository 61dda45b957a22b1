"""What ``mocaplab reproduce`` does: choose a plan, run it, and print the verdicts."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from functools import partial
from pathlib import Path
from time import perf_counter

from mocaplab.commands.evaluate import load_clips
from mocaplab.files import check_writable
from mocaplab.worker_processes import count_cores

DEFAULT_FOLDER = "reproduction"


def reproduce(options: argparse.Namespace) -> None:
    """Redo figures of the papers within a budget of minutes, and judge every claim."""
    # Drawing and networks take seconds to load; a wrong option should be answered at once.
    if options.list:
        from mocaplab.reproduction.figures import list_figures

        print(list_figures())
        return
    if not options.figures:
        raise ValueError("say which figures, or all; mocaplab reproduce --list explains them")
    if options.budget is None:
        raise ValueError("say how many minutes it may take: --budget 5 is a smoke test, 60 a look")
    _reproduce(options)


def _reproduce(options: argparse.Namespace) -> None:
    import matplotlib

    matplotlib.use("agg")  # files are written, no window is opened
    from mocaplab.comparison.job_runner import local_workers
    from mocaplab.reproduction import driver
    from mocaplab.reproduction.figures import read_names
    from mocaplab.reproduction.plan import check_same, load_plan, most_holdouts, save_plan

    figures = read_names(options.figures)
    folder = Path(options.output or DEFAULT_FOLDER).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    check_writable(folder / "plan.json")
    workers = options.workers or count_cores()
    dataset, subjects = load_clips(options.data)
    given, full = Path(options.models) if options.models else None, 0
    if given is not None:
        holdouts = most_holdouts(dataset, options.seed)
        full = driver.count_given(given, dataset, options.seed, holdouts)

    plan = load_plan(folder / "plan.json")
    if plan is None:
        print("measuring how long a step of training takes")
        plan = driver.make_plan(
            figures,
            dataset,
            subjects,
            budget_min=options.budget,
            seed=options.seed,
            workers=workers,
            full=full,
        )
        save_plan(plan, folder / "plan.json")
    else:
        wanted = driver.wanted_plan(figures, dataset, options.budget, options.seed, full)
        check_same(plan, wanted, folder / "plan.json")
    print(f"{len(figures)} figures, {plan.label()}")
    began = perf_counter()
    open_workers = partial(local_workers, processes=workers)
    claims, failed = driver.reproduce(dataset, subjects, plan, figures, folder, open_workers, given)
    minutes = (perf_counter() - began) / 60
    counts = Counter(claim.verdict for claim in claims)
    print(", ".join(f"{n} {verdict}" for verdict, n in counts.items()))
    print(f"took {minutes:.1f} minutes; the report is {folder / 'report.md'}")
    for job, why in failed.items():
        print(f"failed: {job.name}: {why}", file=sys.stderr)
    if failed:
        raise ValueError(
            f"{len(failed)} jobs failed, and what they lack is left out; the whole messages are in "
            f"{folder / 'failed'}, and the same command tries them again"
        )
