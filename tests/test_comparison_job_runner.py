"""Running jobs: on processes, on a cluster, after failures and after a stop."""

import os
import signal
import subprocess
import sys
import time
from functools import partial

import numpy as np
import pytest

from mocaplab.bvh import save_bvh
from mocaplab.comparison import job_runner, result
from mocaplab.comparison.job import Job
from mocaplab.comparison.job_runner import cluster_workers, local_workers, run_jobs, this_process
from mocaplab.comparison.methods import METHODS, Method
from mocaplab.comparison.run_job import run_job
from mocaplab.datasets import Dataset
from mocaplab.splits import Split

RMS = ("rms_all_deg",)


@pytest.fixture(scope="module")
def few(embedded):
    clips = [clip.slice_frames(0, 60) for clip in embedded.clips[:4]]
    return Dataset("few", tuple(clips), ("walk",) * 4)


@pytest.fixture
def jobs():
    return [
        Job("holdout_1", Split((1, 2, 3), (0,)), "angular:0.5", method, RMS, 0, 2)
        for method in ("noisy", "gaussian_58", "butterworth_6hz")
    ]


def numbers(results):
    """Keep of results what must not depend on who computed them, and how fast."""
    return {
        job.name: [{k: v for k, v in row.items() if k != "seconds"} for row in result["rows"]]
        for job, result in results.items()
    }


def test_processes_give_the_same_numbers(few, jobs, tmp_path):
    results, failed = run_jobs(few, jobs, tmp_path, partial(local_workers, processes=2))
    assert not failed
    assert list(results) == jobs
    assert numbers(results) == numbers({job: run_job(few, job) for job in jobs})
    assert len(list((tmp_path / "rows").iterdir())) == 3


def test_what_is_done_is_not_done_again(few, jobs, tmp_path, monkeypatch):
    first, _ = run_jobs(few, jobs[:2], tmp_path, this_process)
    ran = []
    monkeypatch.setattr(job_runner, "run_job", lambda d, j, m: ran.append(j) or run_job(d, j, m))
    results, _ = run_jobs(few, jobs, tmp_path, this_process)
    assert ran == jobs[2:]
    assert list(results) == jobs
    assert [results[job] for job in jobs[:2]] == list(first.values())


def test_a_failing_job_does_not_stop_the_others(few, jobs, tmp_path, monkeypatch):
    def fit(clips):
        raise ValueError("no\nluck")

    monkeypatch.setitem(METHODS, "gaussian_58", Method("gaussian_58", "x", fit))
    results, failed = run_jobs(few, jobs, tmp_path, this_process)
    assert list(results) == [jobs[0], jobs[2]]
    assert failed == {jobs[1]: "ValueError: no luck"}
    whole = (tmp_path / "failed" / f"{jobs[1].name}.txt").read_text()
    assert "Traceback" in whole
    assert "in fit" in whole
    monkeypatch.undo()
    results, failed = run_jobs(few, jobs, tmp_path, this_process)
    assert list(results) == jobs
    assert not failed


def die_at_gaussian_58(dataset, job, models):
    if job.method == "gaussian_58":
        os._exit(1)  # as if the system had killed the process for want of memory
    return run_job(dataset, job, models)


def test_the_others_go_on_when_a_worker_dies(few, jobs, tmp_path, monkeypatch):
    monkeypatch.setattr(job_runner, "run_job", die_at_gaussian_58)
    results, failed = run_jobs(few, jobs, tmp_path, partial(local_workers, processes=1))
    assert list(results) == [jobs[0], jobs[2]]
    assert failed == {jobs[1]: "the worker process died; was there too little memory?"}


def test_processes_use_one_thread_and_leave_the_environment(few, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with local_workers(few, processes=1) as workers:
        assert workers.executor.submit(os.getenv, "OMP_NUM_THREADS").result() == "1"
        assert workers.executor.submit(os.getenv, "MKL_NUM_THREADS").result() == "1"
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


def is_running(group):
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.fixture
def comparison_command(few, tmp_path):
    clips = tmp_path / "clips"
    clips.mkdir()
    for clip in few.clips:
        save_bvh(clip, clips / f"{clip.name}.bvh")
    command = [sys.executable, "-m", "mocaplab", "evaluate", "--data", str(clips)]
    command += ["-o", str(tmp_path / "out"), "--methods", "noisy,gaussian_tuned"]
    return [*command, "--workers", "2", "--holdouts", "3"]


def start_until_rows(command, rows):
    """Start a command in a process group of its own, and wait for its first row."""
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    until = time.monotonic() + 120
    while not (rows.is_dir() and any(rows.glob("*.json"))) and time.monotonic() < until:
        time.sleep(0.02)
    return process


def group_ends(group):
    for _ in range(300):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
def test_ctrl_c_leaves_whole_rows_and_no_process(comparison_command, tmp_path):
    rows = tmp_path / "out" / "rows"
    process = start_until_rows(comparison_command, rows)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to every process
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert errors.endswith("mocaplab evaluate: stopped\n")
    assert group_ends(process.pid)
    assert all(path.suffix == ".json" for path in rows.iterdir())
    before = {path: path.stat().st_mtime_ns for path in rows.iterdir()}
    assert 1 <= len(before) < 6
    subprocess.run(comparison_command, check=True, capture_output=True)
    assert len(list(rows.iterdir())) == 6
    assert all(path.stat().st_mtime_ns == stamp for path, stamp in before.items())


@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
def test_workers_end_with_a_process_that_is_killed(comparison_command, tmp_path):
    process = start_until_rows(comparison_command, tmp_path / "out" / "rows")
    process.kill()
    process.communicate(timeout=60)
    assert group_ends(process.pid)


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0", processes=True
    ) as cluster:
        yield cluster


def test_a_cluster_gives_the_same_numbers(few, jobs, tmp_path, cluster):
    open_cluster = partial(cluster_workers, address=cluster.scheduler_address)
    results, failed = run_jobs(few, jobs, tmp_path, open_cluster)
    assert not failed
    assert numbers(results) == numbers({job: run_job(few, job) for job in jobs})
    unknown = Job("holdout_1", Split((1,), (0,)), "angular:0.5", "nothing", RMS, 0, 1)
    results, failed = run_jobs(few, [unknown, *jobs], tmp_path / "2", open_cluster)
    assert failed == {unknown: "KeyError: 'nothing'"}
    assert list(results) == jobs


def test_workers_with_other_versions_are_refused(few, cluster, monkeypatch):
    monkeypatch.setattr(result, "__version__", "9.9")  # here, not at the workers
    with (
        pytest.raises(ValueError, match=r"expected worker tcp://.* to have .*9\.9"),
        cluster_workers(few, cluster.scheduler_address),
    ):
        pass


def test_a_cluster_without_workers_is_refused(few):
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=":0") as empty,
        pytest.raises(ValueError, match="has no worker"),
        cluster_workers(few, empty.scheduler_address),
    ):
        pass


@pytest.mark.parametrize(
    "address", ["tcp://127.0.0.1:1", "nonsense://x", "tcp://nowhere.invalid:1"]
)
def test_a_scheduler_that_does_not_answer(few, address, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(job_runner, "CONNECT_S", 1)
    with (
        pytest.raises(ConnectionError, match=f"no Dask scheduler answers at {address}"),
        cluster_workers(few, address),
    ):
        pass


def test_distributed_is_asked_for_where_it_is_missing(few, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(ValueError, match=r"pip install 'mocaplab\[cluster\]'"),
        cluster_workers(few, "tcp://127.0.0.1:1"),
    ):
        pass


def test_the_rows_of_a_clip_do_not_depend_on_other_jobs(few, jobs):
    alone = run_job(few, jobs[1])["rows"]
    for job in jobs:
        run_job(few, job)
    again = run_job(few, jobs[1])["rows"]
    np.testing.assert_array_equal(
        [row["rms_all_deg"] for row in alone], [row["rms_all_deg"] for row in again]
    )
