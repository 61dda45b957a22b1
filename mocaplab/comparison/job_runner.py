"""Run the jobs of a comparison on all cores, or on a Dask cluster, and go on after a stop.

Workers only compute. What they return is written here, so that a cluster needs no common
disk.
"""

from __future__ import annotations

import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    wait,
)
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from tqdm.auto import tqdm

from mocaplab.comparison.job import Job
from mocaplab.comparison.result import Result, fingerprint, load_result, save_result, versions
from mocaplab.comparison.run_job import run_job
from mocaplab.datasets import Dataset
from mocaplab.worker_processes import worker_processes

CONNECT_S = 10  # how long a scheduler may take to answer


class Workers(NamedTuple):
    """Something that runs functions elsewhere."""

    executor: Executor
    width: int  # jobs at one time
    dataset: Any  # what to pass in place of the data set; a cluster has it already


OpenWorkers = Callable[[Dataset], AbstractContextManager[Workers]]


@contextmanager
def local_workers(dataset: Dataset, processes: int) -> Iterator[Workers]:
    """Start worker processes on this machine, one thread each."""
    with worker_processes(processes) as executor:
        yield Workers(executor, processes, dataset)


class _AtOnce(Executor):
    """Runs every function when it is submitted, in this process."""

    def submit(self, function: Any, /, *arguments: Any, **options: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments, **options))
        except Exception as error:
            future.set_exception(error)
        return future


@contextmanager
def this_process(dataset: Dataset) -> Iterator[Workers]:
    """Start nothing: jobs run here, one after the other, as suits a notebook and small work."""
    yield Workers(_AtOnce(), 1, dataset)


@contextmanager
def cluster_workers(dataset: Dataset, address: str) -> Iterator[Workers]:
    """Use the workers of a Dask cluster.

    Parameters
    ----------
    dataset : Dataset
    address : str, the scheduler's, such as ``"tcp://10.0.0.1:8786"``

    Raises
    ------
    ValueError
        If distributed is not installed, there is no worker, or one has other versions.
    ConnectionError
        If no scheduler answers.
    """
    try:
        import distributed
    except ImportError:
        raise ValueError(
            "--scheduler needs the package distributed: pip install 'mocaplab[cluster]'"
        ) from None
    try:
        client: Any = distributed.Client(address, timeout=CONNECT_S)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise ConnectionError(f"no Dask scheduler answers at {address} ({error})") from None
    with client:
        width = _check_workers(client, address)
        data = client.scatter(dataset, broadcast=True)
        executor = client.get_executor()
        try:
            yield Workers(executor, 2 * width, data)  # the next job waits at the worker
        finally:
            executor.shutdown(wait=False)


def _check_workers(client: Any, address: str) -> int:
    """Count the threads of all workers, and refuse workers that would give other numbers."""
    threads = client.nthreads()
    if not threads:
        raise ValueError(f"the Dask scheduler at {address} has no worker")
    ours = versions()
    for worker, theirs in client.run(versions, on_error="return").items():
        if theirs != ours:
            raise ValueError(f"expected worker {worker} to have {ours}, got {theirs!r}")
    return sum(threads.values())


def split_done(
    dataset: Dataset, jobs: Sequence[Job], folder: Path
) -> tuple[dict[Job, Result], list[Job]]:
    """Part the jobs whose rows lie in the folder from those still to run.

    Raises
    ------
    ValueError
        If rows there were made with other settings.
    """
    done: dict[Job, Result] = {}
    for job in jobs:
        result = load_result(_path(folder, job), fingerprint(dataset, job))
        if result is not None:
            done[job] = result
    return done, [job for job in jobs if job not in done]


def _path(folder: Path, job: Job) -> Path:
    return folder / "rows" / f"{job.name}.json"


def run_jobs(
    dataset: Dataset, jobs: Sequence[Job], folder: Path, open_workers: OpenWorkers
) -> tuple[dict[Job, Result], dict[Job, str]]:
    """Run the jobs that are not done yet, and show how long the rest will take.

    Every result is written when it comes. A job that fails does not stop the others; if a
    worker process dies, the jobs that were running then have failed.

    Parameters
    ----------
    dataset : Dataset
    jobs : list of Job
    folder : Path
        Results are in its folder rows, trained networks in models, and the whole
        message of a failed job in failed.
    open_workers : function
        Called with the data set, returns a context manager that gives Workers.

    Returns
    -------
    results : dict from Job to what it returned
    failed : dict from Job to a line that says why

    Raises
    ------
    ValueError
        If the folder has rows made with other settings.
    """
    for name in ("rows", "models", "failed"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    results, todo = split_done(dataset, jobs, folder)
    failed: dict[Job, str] = {}
    with tqdm(total=len(jobs), initial=len(results), desc="comparing", unit="job") as bar:
        waiting = deque(todo)
        while waiting:  # a second time only if a worker process died
            with open_workers(dataset) as workers:
                for job, outcome in _run_all(workers, waiting, folder / "models"):
                    if isinstance(outcome, BaseException):
                        failed[job] = _report_failure(
                            outcome, folder / "failed" / f"{job.name}.txt"
                        )
                    else:
                        save_result(_path(folder, job), outcome)
                        results[job] = outcome
                    bar.update()
    return {job: results[job] for job in jobs if job in results}, failed


def _run_all(
    workers: Workers, waiting: deque[Job], models: Path
) -> Iterator[tuple[Job, Result | BaseException]]:
    """Keep all workers busy; yield every outcome when it comes, until the workers break."""
    running: dict[Future[Result], Job] = {}
    while waiting or running:
        try:
            while waiting and len(running) < workers.width:
                future = workers.executor.submit(run_job, workers.dataset, waiting[0], models)
                running[future] = waiting.popleft()
        except BrokenExecutor:
            if not running:
                return
        finished, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in finished:
            yield running.pop(future), future.exception() or future.result()
        if any(isinstance(future.exception(), BrokenExecutor) for future in finished):
            for future, job in running.items():
                yield job, future.exception() or future.result()
            return


def _report_failure(error: BaseException, path: Path) -> str:
    """Write the whole message to a file, and return one line of it."""
    path.write_text("".join(traceback.format_exception(error)), encoding="utf-8")
    if isinstance(error, BrokenExecutor):
        return "the worker process died; was there too little memory?"
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
