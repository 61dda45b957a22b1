"""Frozen frames and spikes found by the clip's own statistics."""

import numpy as np
import pytest

from mocaplab.cleaner.fault_detection import detect_faults
from mocaplab.datasets import load_dataset
from mocaplab.motion import moving_channels
from mocaplab.noise.angular import angular_noise
from mocaplab.noise.faults import frozen_frames, spikes


def test_nothing_is_found_in_clean_clips(embedded):
    faults = [detect_faults(clip) for clip in embedded.clips[::10]]
    samples = sum(clip.channels.size for clip in embedded.clips[::10])
    assert sum(int(found.frozen.sum()) for found in faults) == 0
    assert sum(int(found.spikes.sum()) for found in faults) < 1e-5 * samples


def test_every_frozen_frame_is_found(walk):
    frozen = frozen_frames(walk, 2.0, rng=np.random.default_rng(3))
    moving = moving_channels(walk)
    held = np.zeros(walk.n_frames, dtype=bool)
    held[1:] = (frozen.channels[1:, moving] == frozen.channels[:-1, moving]).all(axis=1)
    assert held.sum() > 10
    faults = detect_faults(frozen)
    np.testing.assert_array_equal(faults.frozen, held)
    hidden = faults.hidden(frozen)
    assert hidden[held][:, walk.skeleton.is_cleaned].all()
    assert not hidden[:, :6].any()


@pytest.mark.parametrize(
    ("noise", "found", "wrong"), [(0.0, 0.95, 1e-5), (0.1, 0.9, 1e-4), (0.5, 0.3, 3e-4)]
)
def test_most_spikes_are_found(walk, noise, found, wrong):
    noisy = angular_noise(walk, noise, rng=np.random.default_rng(0))
    spoilt = spikes(noisy, 0.003, rng=np.random.default_rng(1))
    true = (spoilt.channels != noisy.channels) & moving_channels(walk)
    true[[0, 1, -2, -1]] = False  # at the ends there is too little to compare with
    hits = detect_faults(spoilt).spikes
    assert (hits & true).sum() > found * true.sum()
    assert (hits & ~true).sum() <= wrong * true.size


def test_one_spike_by_hand(walk):
    column = walk.skeleton.channel_index("LeftLeg.Xrotation")
    channels = walk.channels.copy()
    channels[77, column] += 4 * channels[:, column].std()
    found = np.argwhere(detect_faults(walk.with_channels(channels)).spikes)
    assert found.tolist() == [[77, column]]


def test_a_turn_of_the_euler_angles_is_no_spike(walk):
    channels = walk.channels.copy()
    column = walk.skeleton.channel_index("LeftLeg.Xrotation")
    channels[50:, column] += 360.0
    assert not detect_faults(walk.with_channels(channels)).spikes.any()


@pytest.mark.parametrize("n_frames", [1, 2, 3, 5, 9])
def test_short_clips_have_no_faults(walk, n_frames):
    faults = detect_faults(walk.slice_frames(0, n_frames))
    assert not faults.frozen.any()
    assert not faults.spikes.any()


def test_missing_samples_are_neither(walk):
    channels = walk.channels.copy()
    channels[100:140] = np.nan
    channels[:, 20] = np.nan
    faults = detect_faults(walk.with_channels(channels))
    assert not faults.frozen.any()
    assert not faults.spikes[100:140].any()


def test_few_false_alarms_in_recorded_clips(data_dir):
    """Recorded clips have real spikes, in fingers, thumbs and toes most of all."""
    clips = load_dataset("cmu", data_dir / "cmu").clips[2::9]
    faults = [detect_faults(clip) for clip in clips]
    samples = sum(clip.n_frames * int(moving_channels(clip).sum()) for clip in clips)
    assert sum(int(found.spikes.sum()) for found in faults) < 1e-3 * samples
    assert sum(int(found.frozen.sum()) for found in faults) < 1e-3 * sum(c.n_frames for c in clips)
