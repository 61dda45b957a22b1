"""Train the network that cleans streams, on a folder of clean clips.

    python -m data_tools.stream_model "$MOCAPLAB_DATA/cmu" -o mocaplab/data/stream.safetensors

What it learns from is made by the stream itself: noisy clips are pushed through the bank of
estimates frame by frame, so that training sees what a stream will see.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from tqdm.auto import tqdm

from mocaplab.checkpoints import Checkpoint, save_checkpoint
from mocaplab.corruption import corrupt
from mocaplab.datasets import clip_digest, load_folder, split_holdout
from mocaplab.estimate_bank import cosine_windows
from mocaplab.files import check_writable
from mocaplab.learning.blend_lesson import with_mirror
from mocaplab.learning.state import cosine_decay
from mocaplab.live.bank import N_CLUES, N_ESTIMATES, N_PAST, RunningBank, linear_gains
from mocaplab.live.mixer import LiveMixer, LiveMixerConfig
from mocaplab.motion import BoolArray, FloatArray, Motion
from mocaplab.normalization import constant_channels, standardize
from mocaplab.tuning import tune_gaussian

LOOK_AHEADS = (0, 1, 2, 3, 5, 7, 10, 15)  # frames; the network is told which
DRAWS = 4  # times that each clip is spoiled, each time with another noise, speed, look-ahead
N_FOLDS = 4  # a clip's linear estimate must not know the clip: see mocaplab.learning.blend_lesson
LONGEST = 800  # frames of a clip
STRIDE = 3  # of the frames, one in so many is learned from: neighbours are alike
PIECE = 32  # frames (so 96 of the clip) that make up one term of the loss
BATCH = 8  # pieces
EPOCHS = 12
LEARNING_RATE = 3e-3
SPEEDS = (0.6, 1.7)

Lesson = tuple[Tensor, Tensor, Tensor, Tensor, float]
"""Estimates, clues, noise, what should be added to the frames, and the best Gaussian's error."""


def train_mixer(clips: Sequence[Motion], *, seed: int, epochs: int = EPOCHS) -> Checkpoint:
    """Train a mixer on clean clips.

    Parameters
    ----------
    clips : list of Motion, continuous, of one skeleton and frame rate
    seed : int
    epochs : int
    """
    rng = np.random.default_rng(seed)
    constant = constant_channels(clips)
    columns = clips[0].skeleton.is_cleaned & ~constant
    config = LiveMixerConfig(int(columns.sum()), N_ESTIMATES, N_CLUES)
    network = LiveMixer(config, seed=seed)
    moments = torch.stack([_moment(clip, columns, config) for clip in clips])
    network.covariance.copy_(moments.mean(dim=0))
    lessons = list(_lessons(clips, columns, moments, config, rng))
    losses = _descend(network, lessons, epochs, rng)
    noisy = [corrupt(clip, "angular:0.5", rng=rng) for clip in clips]
    gaussian_s, gaussian_per_channel_s = tune_gaussian(noisy)
    return Checkpoint(
        model=network.eval(),
        constant=constant,
        channel_labels=clips[0].skeleton.channel_labels,
        frame_time=clips[0].frame_time,
        gaussian_s=gaussian_s,
        gaussian_per_channel_s=gaussian_per_channel_s,
        info={
            "train": {
                "clips": {clip.name: clip_digest(clip) for clip in clips},
                "seed": seed,
                "epochs": epochs,
                "draws": DRAWS,
            },
            "losses": losses,
        },
    )


def _moment(clip: Motion, columns: BoolArray, config: LiveMixerConfig) -> Tensor:
    """Mean product of all pairs of window coefficients, of a clip and its mirror image."""
    n_windows = config.n_channels * config.n_cosines
    total, versions = torch.zeros(n_windows, n_windows), with_mirror(clip)
    for version in versions:
        values = version.channels[:, columns]
        pose = standardize(values, values.mean(axis=0), values.std(axis=0))
        windows = cosine_windows(
            torch.from_numpy(pose).float()[None], config.radius, config.n_cosines
        )[0]
        total += windows.T @ windows / len(windows) / len(versions)
    return total


def _lessons(
    clips: Sequence[Motion],
    columns: BoolArray,
    moments: Tensor,
    config: LiveMixerConfig,
    rng: np.random.Generator,
) -> Iterator[Lesson]:
    """Spoil every clip some times, and let a stream estimate it."""
    folds = rng.permutation(len(clips)) % N_FOLDS
    for fold in tqdm(range(N_FOLDS), desc="pushing clips through the bank", unit="fold"):
        covariance = moments[torch.from_numpy(folds != fold)].mean(dim=0).double().numpy()
        gains = {
            n: linear_gains(covariance, n, config.radius, config.n_cosines) for n in LOOK_AHEADS
        }
        for index in np.repeat(np.flatnonzero(folds == fold), DRAWS).tolist():
            look_ahead = int(rng.choice(LOOK_AHEADS))
            bank = RunningBank(gains[look_ahead], look_ahead, config.radius)
            versions = with_mirror(clips[index])
            clip = versions[rng.integers(len(versions))]
            clean = _play(clip.channels[:, columns], rng)
            std = clean.std(axis=0)
            noisy = clean + rng.normal(size=clean.shape) * rng.uniform(0, 1) * std
            yield _lesson(bank, noisy, clean)


def _play(values: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Play a stretch of a clip slower or faster."""
    speed = np.exp(rng.uniform(*np.log(SPEEDS)))
    start = int(rng.integers(0, max(len(values) - LONGEST, 0) + 1))
    frames = np.arange(start, min(start + LONGEST, len(values)) - 1, speed)
    before = frames.astype(int)
    part = (frames - before)[:, None]
    played: FloatArray = (1 - part) * values[before] + part * values[before + 1]
    return played


def _lesson(bank: RunningBank, noisy: FloatArray, clean: FloatArray) -> Lesson:
    n_frames = len(noisy)
    estimates, clues, noise = [], [], []
    for newest in range(n_frames + bank.look_ahead):
        if newest < n_frames:
            bank.observe(noisy[newest])
        t = newest - bank.look_ahead
        if t >= 0:
            first = max(0, t - N_PAST)
            known = bank.estimate(noisy[first : newest + 1], t - first)
            estimates.append(known.estimates - noisy[t][:, None])
            clues.append(known.clues)
            noise.append(known.noise)
    error = (np.array(estimates)[..., 1:-1] - (clean - noisy)[..., None]) ** 2
    best = error.mean(axis=0).sum(axis=0).min() + 1e-4 * clean.var(axis=0).sum()
    kept = slice(None, None, STRIDE)
    arrays = (estimates[kept], clues[kept], noise[kept], (clean - noisy)[kept])
    parts = [torch.from_numpy(np.asarray(x, dtype=np.float32)) for x in arrays]
    return parts[0], parts[1], parts[2], parts[3], float(best)


def _descend(
    network: LiveMixer, lessons: Sequence[Lesson], epochs: int, rng: np.random.Generator
) -> list[float]:
    """Adam with a cosine decay; the loss is that of a Blend. Return it epoch by epoch."""
    optimizer = torch.optim.AdamW(network.parameters(), lr=LEARNING_RATE, weight_decay=0.01)
    pieces = [(i, a) for i, x in enumerate(lessons) for a in range(0, len(x[0]), PIECE)]
    n_batches, losses = max(1, len(pieces) // BATCH), []
    for epoch in tqdm(range(epochs), desc="training", unit="epoch"):
        order = rng.permutation(len(pieces))
        epoch_losses = []
        for b in range(n_batches):
            done = (epoch + b / n_batches) / epochs
            for group in optimizer.param_groups:
                group["lr"] = LEARNING_RATE * min(1.0, done * 20 + 0.02) * cosine_decay(done)
            batch = [pieces[i] for i in order[b * BATCH : (b + 1) * BATCH]]
            loss = torch.stack([_loss(network, lessons[i], a) for i, a in batch]).mean()
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimizer.step()
            epoch_losses.append(loss.item())
        losses.append(float(np.mean(epoch_losses)))
    return losses


def _loss(network: LiveMixer, lesson: Lesson, start: int) -> Tensor:
    *arrays, best = lesson
    estimates, clues, noise, wanted = (x[start : start + PIECE] for x in arrays)
    error = ((network.mix(estimates, clues, noise) - wanted) ** 2).sum(dim=-1).mean()
    return (error / best + 1e-3).sqrt()


def main(arguments: Sequence[str] | None = None) -> int:
    """Train the network and write its file."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", help="folder of clean .bvh files; some are held out")
    parser.add_argument("-o", "--output", required=True, type=Path, help="the model file")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    try:
        check_writable(options.output)
        train, _ = split_holdout(load_folder(options.folder))
        began = time.process_time()
        checkpoint = train_mixer(train.clips, seed=options.seed)
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    save_checkpoint(checkpoint, options.output)
    loss = checkpoint.info["losses"][-1]
    print(f"trained in {time.process_time() - began:.0f} CPU seconds, loss {loss:.3f}")
    print(f"wrote {options.output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
