"""Fixtures that many test files share."""

from __future__ import annotations

import os
import re
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from mocaplab.datasets import Dataset, load_dataset
from mocaplab.motion import Motion, Skeleton

RUN_TIME = re.compile(
    r"\*\*Time:\*\* the code runs in about (\d+) (second|minute)s?\. "
    r"Plan (\d+) minutes to work through it\."
)
"""The line that the first cell of every notebook has."""

_seconds: dict[Path, float] = defaultdict(float)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up the time of all cells of a notebook."""
    path = Path(report.fspath)
    if path.suffix == ".ipynb":
        _seconds[path] += report.duration


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print how long each notebook took, beside what its first cell promises."""
    if not _seconds:
        return
    terminalreporter.section("seconds of each notebook")
    for path, seconds in sorted(_seconds.items()):
        found = RUN_TIME.search(path.read_text(encoding="utf-8"))
        promised = int(found[1]) * (60 if found[2] == "minute" else 1) if found else 0
        late = "  longer than half as much again" if seconds > 1.5 * promised else ""
        terminalreporter.write_line(f"{path.stem:32} {seconds:5.0f}  promised {promised:3}{late}")


@pytest.fixture
def data_dir() -> Path:
    """The folder with real clips: ``cmu/``, ``cmu_daz/`` and ``cmu_asfamc/``."""
    folder = os.environ.get("MOCAPLAB_DATA")
    if not folder:
        pytest.skip("set MOCAPLAB_DATA to the folder of real clips to run this test")
    return Path(folder)


@pytest.fixture
def small_motion() -> Motion:
    """Five joints, four Euler orders, one hinge, two End Sites, 40 smooth frames."""
    skeleton = Skeleton(
        joint_names=("Hips", "Spine", "Left Arm", "LeftHand", "Leg"),
        parents=np.array([-1, 0, 1, 2, 0]),
        offsets=np.array([[0, 90, 0], [0, 12.5, 1], [15, 20, 0], [30, 0, 0.1], [9, -5, 0]]),
        channel_names=(
            ("Xposition", "Yposition", "Zposition", "Zrotation", "Yrotation", "Xrotation"),
            ("Xrotation", "Yrotation", "Zrotation"),
            ("Yrotation", "Xrotation", "Zrotation"),
            ("Zrotation", "Xrotation", "Yrotation"),
            ("Xrotation",),
        ),
        end_site_parents=np.array([3, 4]),
        end_site_offsets=np.array([[8, 0, 0], [0, -40, 5.5]]),
    )
    time_s = np.arange(40)[:, None] / 60
    phase = np.arange(skeleton.n_channels)
    channels = 30 * np.sin(2 * np.pi * 0.7 * time_s + phase) + 3 * phase
    return Motion(skeleton, 1 / 60, channels, name="small")


@pytest.fixture(scope="session")
def embedded() -> Dataset:
    """The embedded data set: 100 clips of the 31-joint skeleton."""
    return load_dataset("embedded")


@pytest.fixture(scope="session")
def walk(embedded: Dataset) -> Motion:
    """One embedded walk."""
    return embedded["walk_01"]
