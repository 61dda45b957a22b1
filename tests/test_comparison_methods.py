"""The register of methods, and that none of them can see what it must not."""

import gc
import pickle
import types

import numpy as np
import pytest

from mocaplab.comparison.methods import METHODS
from mocaplab.corruption import corrupt
from mocaplab.filters import GapFiller
from mocaplab.measures.by_name import gap_rms_deg
from mocaplab.motion import Corrupted, Motion, moving_channels

RECIPE = "angular:0.5+gaps:0.001"
TRAINING = ("walk_02", "run_01")
TEST = ("walk_05", "kick_02")
EVERY_METHOD = pytest.mark.parametrize("name", sorted(METHODS))


@pytest.fixture(scope="module")
def fitted(embedded):
    """Every method, fitted once on the training clips."""
    training = clips_of(embedded, TRAINING)
    return {name: method.fit(training) for name, method in METHODS.items()}


def clips_of(embedded, names, n_frames=90):
    return [
        corrupt(embedded[name].slice_frames(0, n_frames), RECIPE, rng=np.random.default_rng(i))
        for i, name in enumerate(names)
    ]


def reachable(start):
    """List every object that can be reached from one, modules and classes left out."""
    skipped = (types.ModuleType, type, types.BuiltinFunctionType)
    seen, queue = {}, [start]
    while queue:
        item = queue.pop()
        if id(item) in seen or isinstance(item, skipped):
            continue
        seen[id(item)] = item
        if isinstance(item, types.FunctionType):  # its globals are the module, not the method
            queue += [item.__closure__, item.__defaults__, item.__dict__]
        else:
            queue += gc.get_referents(item)
    return list(seen.values())


def test_methods_are_named_and_labelled():
    assert all(method.name == name for name, method in METHODS.items())
    labels = [method.label for method in METHODS.values()]
    assert len(set(labels)) == len(labels)


@EVERY_METHOD
def test_methods_clean_a_clip_they_were_not_fitted_on(name, fitted, embedded):
    for clip in clips_of(embedded, TEST[:1]):
        cleaned = fitted[name].denoise(clip.observed, clip.mask)
        assert np.isfinite(cleaned.channels).all()
        moves = moving_channels(clip.clean)
        if isinstance(fitted[name], GapFiller):  # with noise, a curve swings more than a line
            np.testing.assert_array_equal(
                cleaned.channels[clip.mask], clip.observed.channels[clip.mask]
            )
            continue
        errors = [
            np.mean((x.channels - clip.clean.channels)[:, moves] ** 2)
            for x in (cleaned, METHODS["noisy"].fit([]).denoise(clip.observed, clip.mask))
        ]
        assert errors[0] <= errors[1]


def test_what_fills_gaps_by_other_joints_beats_lines_in_long_gaps(fitted, embedded):
    motion = embedded[TRAINING[0]].slice_frames(0, 90)
    clips = [corrupt(motion, "long_gaps:0.4", rng=np.random.default_rng(seed)) for seed in range(5)]
    error = {
        name: np.mean(
            [gap_rms_deg(fitted[name].denoise(c.observed, c.mask), c.clean, c.mask) for c in clips]
        )
        for name in ("noisy", "pchip", "spline", "pca", "lowrank")
    }
    assert len(set(error.values())) == len(error)  # each fills in its own way
    assert max(error["pca"], error["lowrank"]) < 0.5 * error["noisy"]


@EVERY_METHOD
def test_the_truth_of_a_test_clip_does_not_matter(name, fitted, embedded):
    """It is overwritten where it lies in memory, and nothing leads from the input to it."""
    (drawn,) = clips_of(embedded, TEST[:1])
    clean = drawn.clean.with_channels(drawn.clean.channels.copy())
    clip = Corrupted(clean, drawn.observed, drawn.mask)
    cleaned = fitted[name].denoise(clip.observed, clip.mask).channels
    clean.channels.setflags(write=True)
    clean.channels[:] = np.nan
    again = fitted[name].denoise(clip.observed, clip.mask).channels
    np.testing.assert_array_equal(again, cleaned)
    assert not any(item is drawn.clean for item in reachable(drawn.observed))
    assert not any(np.shares_memory(item, drawn.clean.channels) for item in arrays(drawn.observed))


def arrays(start):
    return [item for item in reachable(start) if isinstance(item, np.ndarray)]


@EVERY_METHOD
def test_fitting_is_repeatable_and_cleaning_changes_no_parameter(name, fitted, embedded):
    again = METHODS[name].fit(clips_of(embedded, TRAINING))
    before = pickle.dumps(again)
    assert before == pickle.dumps(fitted[name])
    (clip,) = clips_of(embedded, TEST[:1])
    cleaned = again.denoise(clip.observed, clip.mask).channels
    # Another test clip in between leaves no trace, neither in the parameters nor in the result.
    (other,) = clips_of(embedded, TEST[1:])
    again.denoise(other.observed, other.mask)
    assert pickle.dumps(again) == before
    np.testing.assert_array_equal(again.denoise(clip.observed, clip.mask).channels, cleaned)


@EVERY_METHOD
def test_a_denoiser_keeps_no_clip(name, fitted, embedded):
    (clip,) = clips_of(embedded, TEST[:1])
    fitted[name].denoise(clip.observed, clip.mask)
    kept = reachable(fitted[name])
    assert not any(isinstance(item, Corrupted | Motion) for item in kept)
    mine = [item for item in kept if isinstance(item, np.ndarray)]
    for theirs in (clip.clean.channels, clip.observed.channels):
        assert not any(np.shares_memory(item, theirs) for item in mine)


@EVERY_METHOD
@pytest.mark.parametrize("n_frames", [1, 2, 3])
def test_very_short_clips_are_cleaned_or_refused_in_words(name, n_frames, fitted, embedded):
    motion = embedded["walk_05"].slice_frames(0, n_frames)
    cleaned = fitted[name].denoise(motion, np.ones(motion.channels.shape, dtype=bool))
    assert cleaned.channels.shape == motion.channels.shape
    assert np.isfinite(cleaned.channels).all()
