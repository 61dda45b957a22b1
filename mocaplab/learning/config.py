"""How a network is trained: one number a line."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class TrainConfig:
    """How to train. Paper A, section 3: L2 loss, Adam, 200 epochs."""

    epochs: int = 200  # an epoch sees every frame once on average
    patience: int = 0  # stop after so many epochs without a lower validation loss; 0: never
    batch_size: int = 16  # pieces a step
    n_frames: int = 150  # frames a piece, margins included
    margin: int = 15  # frames at each cut end that the loss leaves out
    learning_rate: float = 3e-3  # its peak; it rises at first, then falls along a cosine to 0
    weight_decay: float = 0.0  # share by which weights shrink, at a learning rate of 1
    gradient_norm: float = 1.0  # longer gradients are cut to this length
    k_low: float = 0.0  # the amount of noise of each piece is drawn
    k_high: float = 1.0  # between these two, so that any noise can be met later
    speed_low: float = 0.6  # each piece is played slower or faster, by a factor
    speed_high: float = 1.7  # between these two, so that new speeds can be met later
    gap_probability: float = 0.0  # that a gap starts, a channel and 1/120 s; for an EBD
    gap_mean_s: float = 0.5  # mean length of these gaps
    jump_rate: float = 0.0  # share of pieces in which a joint jumps, over that of clips in which
    # it does: in some captures thumbs jump
    gaussian_k: float = 0.5  # the noise for which the Gaussian is tuned
    seed: int = 0  # of first weights, pieces, noise and dropout

    def __post_init__(self) -> None:
        for name in ("epochs", "batch_size", "n_frames", "learning_rate", "gradient_norm"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be above 0, got {getattr(self, name)}")
        for low, high in ((self.k_low, self.k_high), (self.speed_low, self.speed_high)):
            if not 0 <= low <= high:
                raise ValueError(f"a range must go up from 0 or more, got {low} to {high}")
        if not 0 <= self.gap_probability <= 1:
            raise ValueError(f"gap_probability must lie in [0, 1], got {self.gap_probability}")
        if not 0 <= self.jump_rate < math.inf:
            raise ValueError(f"jump_rate must be 0 or more, got {self.jump_rate}")
        if self.patience < 0:
            raise ValueError(f"patience must be 0 epochs or more, got {self.patience}")


EBF_TRAINING = TrainConfig(learning_rate=1e-3, jump_rate=2.0)
"""How an EBF is trained. At higher rates, which are good for a few epochs, the tanh layers before
the filter saturated in some trainings, which hardly learnt anything from then on. Jumps teach it to
be narrow where a joint jumps: few captures have such jumps, and those are full of them."""
BLEND_TRAINING = TrainConfig(epochs=20, batch_size=24, n_frames=96, margin=8, weight_decay=0.01)
"""How a Blend is trained; it needs fewer epochs, since it has less to learn."""
EBD_TRAINING = TrainConfig(epochs=700, n_frames=240, gap_probability=0.002)
"""How an EBD is trained to fill gaps; long pieces, so that long gaps have room in them."""
