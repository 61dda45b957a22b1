"""What ``mocaplab reproduce`` does: choose a plan, run it, and print the verdicts."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from functools import partial
from pathlib import Path
from time import perf_counter

from mocaplab.commands.compare import load_clips
from mocaplab.commands.option_types import add_seed, count, minutes
from mocaplab.files import check_writable
from mocaplab.worker_processes import count_cores

DEFAULT_FOLDER = "reproduction"


SUMMARY = "redo the papers' figures within a budget of minutes, and judge every claim"
DETAILS = (
    "The budget decides how many holdouts, repetitions, epochs and clips there are, after\n"
    "a step of training has been measured; every figure says what it was made with. Each\n"
    "comes as CSV, as a picture with the paper's axes, and with a paragraph of what\n"
    "agrees and what does not; report.html has them all and the table of claims. What was\n"
    "stopped goes on when the same command is given again.\n\n"
    "examples:\n"
    "  mocaplab reproduce --list\n"
    "  mocaplab reproduce 8 --budget 10\n"
    "  mocaplab reproduce all --data my_clips --budget 60 -o my_reproduction"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what can be set."""
    add = parser.add_argument
    add("figures", nargs="*", metavar="FIGURE", help="3, 4, ... as --list names them, or all")
    add("--list", action="store_true", help="explain all figures, and do nothing else")
    add(
        "--data",
        default="embedded",
        metavar="FOLDER",
        help="clean BVH files (default: %(default)s, the made-up clips)",
    )
    add("--budget", type=minutes, metavar="MINUTES", help="5 is a smoke test, 10000 all of it")
    add("-o", "--output", metavar="FOLDER", help="for all files (default: reproduction)")
    add_seed(parser)
    add("--workers", type=count, metavar="N", help="processes (default: one a core)")
    add(
        "--models",
        metavar="FOLDER",
        help="the folder models of mocaplab evaluate --data --methods ebf,blend of the same clips "
        "and seed: its fully trained networks stand for EBF and Blend where they can",
    )


def run(options: argparse.Namespace) -> None:
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
    print(f"took {minutes:.1f} minutes; the report is {folder / 'report.html'}")
    for job, why in failed.items():
        print(f"failed: {job.name}: {why}", file=sys.stderr)
    if failed:
        raise ValueError(
            f"{len(failed)} jobs failed, and what they lack is left out; the whole messages are in "
            f"{folder / 'failed'}, and the same command tries them again"
        )
