"""Time one training step of an EBF against its parts.

    python tests/benchmarks/bench_training.py

Prints ratios of CPU seconds on one core (medians): the whole step, drawing its batch
included, over forward and backward through the LSTM alone; the filter layer over the LSTM;
and the LSTM over a matrix product with as many multiply-adds, the floor of this machine.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import numpy as np
import torch

from mocaplab.adaptive_filter import adaptive_gaussian
from mocaplab.datasets import load_dataset
from mocaplab.learning.config import EBF_TRAINING
from mocaplab.learning.lessons import WindowLesson
from mocaplab.learning.state import TrainingState
from mocaplab.networks import EBFConfig, build_network


def cpu_seconds(tasks: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Median of each task; they take turns, so that a busy minute falls on all of them."""
    seconds: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(repeats + 1):
        for name, task in tasks.items():
            start = time.process_time()
            task()
            seconds[name].append(time.process_time() - start)
    return {name: statistics.median(values[1:]) for name, values in seconds.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--repeats", type=int, default=15)
    repeats = parser.parse_args().repeats
    torch.set_num_threads(1)
    config, rng = EBF_TRAINING, np.random.default_rng(0)
    dataset = load_dataset("embedded")
    columns = dataset.skeleton.is_cleaned
    lesson = WindowLesson(dataset.clips, config, columns)
    lesson.windows.jump_share[:] = 0.01  # about what recorded clips have; in these nothing jumps
    network = build_network(EBFConfig(int(columns.sum())), seed=0)
    optimizer = TrainingState(network).optimizer

    def step() -> None:
        loss = lesson.loss(network, next(lesson.batches(rng)))
        optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), config.gradient_norm)
        optimizer.step()

    n_frames = config.batch_size * config.n_frames
    code = torch.randn(config.batch_size, config.n_frames, network.config.n_code)
    pose = torch.randn(config.batch_size, config.n_frames, network.config.n_channels)
    sigma = (torch.rand(pose.shape) * 5 + 0.2).requires_grad_()
    lstm = network.lstm
    # Four gates a unit, twice: from what comes in and from the state; three passes of that,
    # one forward and two backward.
    n_hidden = network.config.n_hidden
    inputs = network.config.n_code + 2 * n_hidden
    left = torch.randn(n_frames, inputs + 2 * n_hidden)
    right = torch.randn(inputs + 2 * n_hidden, 2 * 4 * n_hidden)

    seconds = cpu_seconds(
        {
            "step": step,
            "lstm": lambda: lstm(code)[0].square().mean().backward(),
            "filter": lambda: adaptive_gaussian(pose, sigma).square().mean().backward(),
            "product": lambda: [left @ right for _ in range(3)],
        },
        repeats,
    )
    print(f"{n_frames} frames a step, {network.config.n_channels} channels, one core")
    print(f"step / LSTM            {seconds['step'] / seconds['lstm']:.2f}")
    print(f"filter / LSTM          {seconds['filter'] / seconds['lstm']:.2f}")
    print(f"LSTM / matrix product  {seconds['lstm'] / seconds['product']:.2f}")
    print(f"frames a second        {n_frames / seconds['step']:,.0f}")


if __name__ == "__main__":
    main()
