"""Processes of this machine that work in parallel, one thread each."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager

THREAD_LIMITS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@contextmanager
def worker_processes(processes: int) -> Iterator[ProcessPoolExecutor]:
    """Start processes, and end them with the with-block, however that ends.

    Parameters
    ----------
    processes : int
    """
    before = {name: os.environ.get(name) for name in THREAD_LIMITS}
    children = set(multiprocessing.active_children())
    os.environ.update(dict.fromkeys(THREAD_LIMITS, "1"))  # read when a worker imports numpy
    executor = ProcessPoolExecutor(
        processes, multiprocessing.get_context("spawn"), initializer=_start_worker
    )
    try:
        yield executor
        executor.shutdown()
    except BaseException:  # what the workers are at would be lost in any case
        executor.shutdown(wait=False, cancel_futures=True)
        for child in set(multiprocessing.active_children()) - children:
            child.terminate()
        raise
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _start_worker() -> None:
    """Leave Ctrl-C, which a terminal sends to every process, to the one that started them."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End when the process that takes the results is gone, however it ended."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def count_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
