"""Fixtures that many test files share."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from mocaplab.datasets import Dataset, load_dataset
from mocaplab.motion import Motion, Skeleton


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
