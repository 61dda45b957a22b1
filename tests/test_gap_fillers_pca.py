"""Filling gaps from the rest of the pose: PCA, and Kalman smoothing of its scores."""

import numpy as np
import pytest

from mocaplab.filters import filter_motion
from mocaplab.gap_fillers.curves import GapWarning, lerp_gaps
from mocaplab.gap_fillers.lowrank import fit_lowrank_gaps, lowrank_gaps
from mocaplab.gap_fillers.pca import fit_pca_gaps, pca_gaps
from mocaplab.gap_fillers.pose_subspace import TrainingPoses, described_columns, fit_subspace
from mocaplab.motion import Corrupted, moving_channels

OWN = [pca_gaps, lowrank_gaps]
FITS = [fit_pca_gaps, fit_lowrank_gaps]


def as_training(*motions):
    return [Corrupted(m, m, np.ones(m.channels.shape, dtype=bool)) for m in motions]


def low_rank(walk, n_frames=500, rank=5, seed=0):
    """A motion whose 90 joint angles are mixtures of a few smooth curves."""
    rng = np.random.default_rng(seed)
    time = np.arange(n_frames)[:, None] * walk.frame_time
    curves = np.sin(2 * np.pi * rng.uniform(0.5, 2, rank) * time + rng.uniform(0, 6, rank))
    mixture = np.random.default_rng(99).normal(scale=10, size=(rank, walk.skeleton.n_channels))
    channels = walk.channels.mean(axis=0) + curves @ mixture
    channels[:, ~walk.skeleton.is_cleaned] = walk.channels[0, ~walk.skeleton.is_cleaned]
    return type(walk)(walk.skeleton, walk.frame_time, channels, "low rank")


def hide(motion, *gaps):
    """Hide (label, start, stop)."""
    channels = motion.channels.copy()
    for label, start, stop in gaps:
        channels[start:stop, motion.skeleton.channel_index(label)] = np.nan
    return motion.with_channels(channels)


GAPS = [("LeftLeg.Xrotation", 100, 250), ("LeftArm.Zrotation", 200, 320), ("Head.Xrotation", 5, 90)]


@pytest.mark.parametrize("fill", OWN)
def test_a_low_rank_motion_is_filled_exactly(fill, walk):
    clean = low_rank(walk)
    gappy = hide(clean, *GAPS)
    assert np.abs(lerp_gaps(gappy).channels - clean.channels).max() > 10
    np.testing.assert_allclose(fill(gappy).channels, clean.channels, atol=1e-5)


@pytest.mark.parametrize("fill", OWN)
def test_a_gap_at_either_end_of_the_clip(fill, walk):
    clean = low_rank(walk)
    gappy = hide(clean, ("LeftLeg.Xrotation", 0, 60), ("LeftArm.Zrotation", 430, 500))
    np.testing.assert_allclose(fill(gappy).channels, clean.channels, atol=1e-5)


@pytest.mark.parametrize("fit", FITS)
def test_training_clips_help_where_no_frame_is_complete(fit, walk):
    clean = low_rank(walk)
    fill = fit(as_training(low_rank(walk, seed=1), low_rank(walk, seed=2)))
    gappy = hide(clean, ("LeftLeg.Xrotation", 0, 210), ("LeftArm.Zrotation", 205, 500))
    error = np.abs(fill(gappy).channels - clean.channels)
    by_lines = np.abs(lerp_gaps(gappy).channels - clean.channels)
    assert error.mean() < 0.3 * by_lines.mean()


def test_own_clip_without_a_complete_frame_fits_and_fills_in_turns(walk):
    clean = low_rank(walk)
    labels = [walk.skeleton.channel_labels[c] for c in np.flatnonzero(moving_channels(clean))]
    gaps = [(labels[i], 25 * i, 25 * i + 30) for i in range(20)]
    gappy = hide(clean, *gaps)
    assert np.isnan(gappy.channels).any(axis=1).all()
    error = np.abs(pca_gaps(gappy).channels - clean.channels).max()
    assert error < 0.1 * np.abs(lerp_gaps(gappy).channels - clean.channels).max()


def test_scores_equal_the_mean_of_a_gaussian_given_what_is_visible(walk):
    """The textbook formula, with the dense covariance of all channels."""
    clean = low_rank(walk, rank=30)
    columns = described_columns(clean)
    space = fit_subspace(clean, columns)
    hidden = np.zeros(len(columns), dtype=bool)
    hidden[[3, 10, 11]] = True
    dense = space.loadings @ space.loadings.T + np.diag(space.variance)
    seen = clean.channels[100, columns] - space.mean
    weights = np.linalg.solve(dense[np.ix_(~hidden, ~hidden)], seen[~hidden])
    expected = space.mean[hidden] + dense[np.ix_(hidden, ~hidden)] @ weights

    vector, precision = space.evidence(clean.channels[[100]][:, columns], ~hidden[None])
    scores = np.linalg.solve(precision[0] + np.eye(vector.shape[1]), vector[0])
    np.testing.assert_allclose(space.poses(scores[None])[0, hidden], expected, rtol=1e-6)


@pytest.mark.parametrize("fill", OWN)
def test_observed_samples_and_motions_without_gaps_come_back_bit_for_bit(fill, walk):
    np.testing.assert_array_equal(fill(walk).channels, walk.channels)
    gappy = hide(walk, ("LeftLeg.Xrotation", 30, 60))
    observed = ~np.isnan(gappy.channels)
    np.testing.assert_array_equal(fill(gappy).channels[observed], walk.channels[observed])


@pytest.mark.parametrize("fill", OWN)
def test_fills_meet_the_observed_samples(fill, walk):
    """The step into and out of a gap is no larger than the largest step of the clean clip."""
    column = walk.skeleton.channel_index("LeftLeg.Xrotation")
    filled = fill(hide(walk, ("LeftLeg.Xrotation", 60, 150))).channels[:, column]
    largest = np.abs(np.diff(walk.channels[:, column])).max()
    assert np.abs(np.diff(filled))[[59, 149]].max() < largest


@pytest.mark.parametrize("fill", OWN)
def test_frames_that_see_nothing_are_bridged(fill, walk):
    channels = walk.channels.copy()
    channels[60:70, walk.skeleton.is_cleaned] = np.nan
    filled = fill(walk.with_channels(channels)).channels
    error = (filled - walk.channels)[60:70][:, moving_channels(walk)]
    assert np.sqrt(np.mean(error**2)) < 2.0


@pytest.mark.parametrize("fill", OWN)
def test_inside_a_denoiser_angles_may_jump_by_full_turns(fill, walk):
    gappy = hide(walk, ("LeftArm.Zrotation", 50, 90))
    jumpy = gappy.channels.copy()
    column = walk.skeleton.channel_index("LeftArm.Zrotation")
    jumpy[90:, column] -= 360
    plain = filter_motion(gappy, lambda m: m.channels, fill).channels
    jumped = filter_motion(gappy.with_channels(jumpy), lambda m: m.channels, fill).channels
    np.testing.assert_allclose(jumped[:90], plain[:90], atol=1e-6)
    np.testing.assert_array_equal(jumped[90:], jumpy[90:])


@pytest.mark.parametrize("fill", OWN)
def test_the_root_and_still_channels_take_straight_lines(fill, walk):
    still = np.flatnonzero(~moving_channels(walk) & walk.skeleton.is_cleaned)[0]
    label = walk.skeleton.channel_labels[still]
    gappy = hide(walk, ("Hips.Xposition", 30, 60), (label, 10, 50))
    np.testing.assert_array_equal(fill(gappy).channels, lerp_gaps(gappy).channels)


@pytest.mark.parametrize("fill", OWN)
def test_a_channel_never_observed_is_left_at_rest_and_named(fill, walk):
    gappy = hide(walk, ("LeftLeg.Xrotation", 0, None), ("LeftArm.Zrotation", 30, 60))
    with pytest.warns(GapWarning, match=r"LeftLeg\.Xrotation"):
        filled = fill(gappy)
    assert np.all(filled.channel("LeftLeg.Xrotation") == 0)
    assert np.isfinite(filled.channels).all()


@pytest.mark.parametrize("fill", OWN)
@pytest.mark.parametrize("n_frames", [1, 2, 3, 5])
def test_very_short_clips(fill, walk, n_frames):
    short = walk.slice_frames(0, n_frames)
    np.testing.assert_array_equal(fill(short).channels, short.channels)
    if n_frames > 2:
        gappy = hide(short, ("LeftLeg.Xrotation", 1, 2))
        assert np.abs(fill(gappy).channels - short.channels).max() < 3


@pytest.mark.parametrize("fit", FITS)
def test_training_refuses_nothing_and_mixed_skeletons(fit, walk, small_motion):
    with pytest.raises(ValueError, match="at least one training clip, got none"):
        fit([])
    with pytest.raises(ValueError, match="'small' has other joints"):
        fit(as_training(walk, small_motion))
    gappy = hide(small_motion, ("Leg.Xrotation", 10, 20))
    with pytest.raises(ValueError, match="'small' has other joints or channels than the training"):
        fit(as_training(walk))(gappy)


def test_training_covariance_is_numpys(walk):
    covariance = TrainingPoses.of(as_training(low_rank(walk))).covariance
    np.testing.assert_allclose(covariance, np.cov(low_rank(walk).channels.T, bias=True), atol=1e-9)


@pytest.mark.parametrize("fit", FITS)
def test_two_frame_rates_agree(fit, walk):
    fine = low_rank(walk, rank=30)
    coarse = type(fine)(fine.skeleton, 4 * fine.frame_time, fine.channels[::4])
    fill = fit(as_training(low_rank(walk, rank=30, seed=3)))
    at_120 = fill(hide(fine, ("LeftLeg.Xrotation", 101, 240))).channel("LeftLeg.Xrotation")
    at_30 = fill(hide(coarse, ("LeftLeg.Xrotation", 26, 60))).channel("LeftLeg.Xrotation")
    moved = np.ptp(fine.channel("LeftLeg.Xrotation"))
    assert np.abs(at_120[::4] - at_30).max() < 0.03 * moved
