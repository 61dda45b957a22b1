"""The networks as methods: each can be trained, kept and read back."""

import numpy as np
import pytest

from mocaplab.comparison.methods import NETWORK_LABELS
from mocaplab.comparison.network_methods import (
    LEAST_FRAMES_SEEN,
    SHAPES,
    enough_epochs,
    train_method,
    training_recipe,
)
from mocaplab.gap_fillers.curves import lerp_gaps
from mocaplab.motion import moving_channels
from mocaplab.noise.gaps import hide


@pytest.fixture(scope="module")
def clips(embedded):
    return [clip.slice_frames(0, 160) for clip in embedded.clips[:2]]


def test_every_network_has_a_label_and_a_shape():
    assert set(SHAPES) == set(NETWORK_LABELS)


@pytest.mark.parametrize("name", SHAPES)
def test_each_is_trained_kept_and_read_back(name, clips, tmp_path):
    model, state = tmp_path / "model.safetensors", tmp_path / "state"
    trained = train_method(name, clips, 1, model, state)
    assert not state.exists()
    again = train_method(name, clips, 1, model, state)
    noisy = clips[0].with_channels(
        clips[0].channels + np.random.default_rng(0).normal(size=clips[0].channels.shape)
    )
    mask = np.ones(noisy.channels.shape, dtype=bool)
    mask[60:80, moving_channels(noisy)] = False  # one of the networks fills gaps
    holed = hide(noisy, mask)
    cleaned = trained.denoise(holed, mask)
    np.testing.assert_array_equal(cleaned.channels, again.denoise(holed, mask).channels)
    root = ~clips[0].skeleton.is_cleaned
    np.testing.assert_array_equal(cleaned.channels[:, root], noisy.channels[:, root])
    changed = (cleaned.channels != lerp_gaps(holed).channels).any(axis=0)
    assert changed[moving_channels(clips[0])].all()


def test_a_file_of_other_clips_or_another_training_is_refused(clips, tmp_path):
    model = tmp_path / "model.safetensors"
    train_method("nn", clips, 1, model, None)
    for name, training, epochs, other in (
        ("nn", clips[:1], 1, "clips"),
        ("ebd_denoiser", clips, 1, "layers, learning_rate, jump_rate"),
        ("ebf", clips, 1, "layers"),
        ("nn", clips, 2, "epochs"),
        ("nn@angular:0.5", clips, 1, "k_low, k_high"),
        ("nn@spatial:0.5", clips, 1, "recipe"),
    ):
        with pytest.raises(ValueError, match=f"with other {other}; take it away"):
            train_method(name, training, epochs, model, None)


def test_recipes():
    assert training_recipe("ebf", None).epochs == 200
    assert training_recipe("blend", None, seed=3).seed == 3
    assert training_recipe("blend", 7).epochs == 7


def test_few_frames_are_seen_more_often():
    assert enough_epochs("blend", 35_000) == 20
    assert enough_epochs("ebf", 35_000) == 200
    assert 1000 * enough_epochs("blend", 1000) >= LEAST_FRAMES_SEEN
