import numpy as np
import pytest

from mocaplab.poses import motion_to_quaternions
from mocaplab.two_sources.noise import SourceNoise, two_sources
from mocaplab.two_sources.time_offset import common_frames, find_offset


@pytest.fixture(scope="module")
def long_walk(embedded):
    clip = max((c for c in embedded.clips if c.name.startswith("walk")), key=lambda c: c.n_frames)
    return motion_to_quaternions(clip), clip.frame_time


@pytest.mark.parametrize("shift", [-100, -7, 0, 1, 36, 119])
def test_a_known_offset_is_found_under_noise(long_walk, shift):
    q, frame_time = long_walk
    a, b = two_sources(q, SourceNoise(), rng=np.random.default_rng(abs(shift)))
    a = a[max(0, shift) :][: len(q) - 120]
    b = b[max(0, -shift) :][: len(q) - 120]
    found = find_offset(a, b, frame_time)
    assert found.frames == shift
    assert found.seconds == pytest.approx(shift * frame_time)
    assert found.correlation > 0.7


def test_common_frames_by_hand():
    # Frame t of a is frame t + 3 of b: the first 3 frames of b have no partner.
    assert common_frames(10, 10, 3) == (slice(0, 7), slice(3, 10))
    assert common_frames(10, 10, -4) == (slice(4, 10), slice(0, 6))
    assert common_frames(5, 20, 3) == (slice(0, 5), slice(3, 8))
    with pytest.raises(ValueError, match="share none"):
        common_frames(5, 5, 6)


def test_noise_has_no_offset(long_walk):
    q, frame_time = long_walk
    noise = np.random.default_rng(0).normal(size=q.shape)
    noise /= np.linalg.norm(noise, axis=-1, keepdims=True)
    with pytest.raises(ValueError, match=r"correlation of at most 0\.\d\d within 1 s"):
        find_offset(q, noise, frame_time)


def test_what_cannot_be_compared_is_refused(long_walk):
    q, frame_time = long_walk
    with pytest.raises(ValueError, match="expected at least 60 frames"):
        find_offset(q[:20], q, frame_time)
    with pytest.raises(ValueError, match="same joints"):
        find_offset(q, q[:, :5], frame_time)
    still = np.zeros((200, 3, 4))
    still[..., 0] = 1
    with pytest.raises(ValueError, match="nothing but the root moves"):
        find_offset(still, still, frame_time)
