"""Training on one recipe: pieces of clips that were corrupted beforehand."""

import numpy as np
import pytest
import torch

from mocaplab.blend import BlendConfig
from mocaplab.learning.config import TrainConfig
from mocaplab.learning.lessons import batch_loss
from mocaplab.learning.recipe_lesson import DRAWS, RecipeLesson
from mocaplab.motion import moving_channels
from mocaplab.training import train

CONFIG = TrainConfig(epochs=1, batch_size=6, n_frames=50, margin=5)


@pytest.fixture(scope="module")
def clips(embedded):
    return [embedded.clips[0].slice_frames(0, 90), embedded.clips[1].slice_frames(0, 40)]


@pytest.fixture(scope="module")
def columns(clips):
    return clips[0].skeleton.is_cleaned & moving_channels(clips[0])


def test_pieces_are_of_the_clips_and_their_corrupted_versions(clips, columns):
    lesson = RecipeLesson(clips, "biased:0.2", CONFIG, columns)
    (batch,) = list(lesson.batches(np.random.default_rng(1)))
    assert lesson.n_batches == 1  # 90 + 50 frames, in pieces that count 40, six a batch
    short = np.pad(clips[1].channels, ((0, 10), (0, 0)), mode="symmetric")
    found = set()
    for piece, observed in zip(batch.clean, batch.observed, strict=True):
        matches = [
            (i, start)
            for i, whole in enumerate((clips[0].channels, short))
            for start in range(len(whole) - 49)
            if np.array_equal(whole[start : start + 50], piece)
        ]
        assert len(matches) == 1
        found.add(matches[0][0])
        # A bias of half a deviation and noise of a fifth, in what moves, and nothing else.
        clip = clips[matches[0][0]]
        moves = moving_channels(clip)
        error = ((observed - piece) / np.where(moves, clip.channels.std(axis=0), 1.0)).mean(axis=0)
        np.testing.assert_allclose(error[moves], 0.5, atol=0.2)
        np.testing.assert_array_equal(error[~moves], 0)
    assert found == {0, 1}


def test_margins_count_only_at_the_ends_of_a_clip(clips, columns):
    lesson = RecipeLesson(clips[:1], "uniform:0.5", CONFIG, columns)
    rng = np.random.default_rng(0)
    weights = np.concatenate([next(lesson.batches(rng)).weight for _ in range(30)])
    assert weights[:, 5:-5].all()
    first, last = weights[:, 0], weights[:, -1]
    assert not (first * last).any()  # the clip is longer than a piece: never both ends
    assert 0 < first.mean() < 0.5
    assert 0 < last.mean() < 0.5


def test_scale_is_that_of_the_whole_corrupted_clip(clips, columns):
    lesson = RecipeLesson(clips[:1], "uniform:0.5", CONFIG, columns)
    (batch,) = list(lesson.batches(np.random.default_rng(0)))
    assert len(lesson.observed[0]) == DRAWS
    scales = [drawn.std(axis=0) * moving_channels(clips[0]) for drawn in lesson.observed[0]]
    for std in batch.std[:, 0]:
        assert any(np.array_equal(std, scale) for scale in scales)


def test_gaps_are_closed(clips, columns):
    lesson = RecipeLesson(clips[:1], "gaps:0.02", CONFIG, columns)
    (batch,) = list(lesson.batches(np.random.default_rng(0)))
    assert np.isfinite(batch.observed).all()
    assert (batch.observed != batch.clean).any()


def test_loss_is_that_of_other_lessons(clips, columns):
    lesson = RecipeLesson(clips[:1], "uniform:0.5", CONFIG, columns)
    batch = next(lesson.batches(np.random.default_rng(0)))

    class Same(torch.nn.Module):
        def __init__(self):
            super().__init__()
            self.weight = torch.nn.Parameter(torch.ones(1))

        def forward(self, pose, root_velocity):
            return pose * self.weight

    network = Same()
    with torch.no_grad():
        assert lesson.loss(network, batch) == batch_loss(network, batch, columns)


def test_training_remembers_its_recipe(clips, tmp_path):
    state = tmp_path / "state.part"
    checkpoint = train(clips, CONFIG, recipe="uniform:0.5", state_path=state, progress=False)
    assert checkpoint.info["train"]["recipe"] == "uniform:0.5"
    assert state.exists()
    assert "recipe" not in train(clips, CONFIG, progress=False).info["train"]
    with pytest.raises(ValueError, match="other settings or clips"):
        train(clips, CONFIG, recipe="biased:0.5", state_path=state, progress=False)


def test_blend_takes_no_recipe(clips):
    with pytest.raises(ValueError, match=r"draws its own noise, and takes no recipe \(uniform"):
        train(clips, CONFIG, BlendConfig, recipe="uniform:0.5", progress=False)
