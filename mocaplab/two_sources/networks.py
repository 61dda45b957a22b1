"""The two networks of paper B: fuse two noisy sources, and predict the next frames.

Both are an encoder, a two-layer LSTM, and a decoder of dense layers (section "Methods", Figure
2). Modules only: no training loop and no file. Letters in shapes: B clips in a batch, T frames,
J joints, h units.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from mocaplab.layers import check_sizes, dense, seeded, start_near
from mocaplab.two_sources.losses import same_side, unit

PAPER_WIDTH = 1000
"""LSTM units in each layer in the paper; our default trains in minutes on two cores."""


@dataclass(frozen=True)
class TwoSourceConfig:
    """The shape of a TwoSourceLSTM."""

    n_joints: int  # J
    n_hidden: int = 128  # LSTM units in each layer; 1000 in the paper
    n_layers: int = 2  # LSTM layers, and dense layers of the decoder
    faithful: bool = False  # the paper's: four raw numbers a joint, found without the mean

    def __post_init__(self) -> None:
        check_sizes(self, "n_joints", "n_hidden", "n_layers")


class TwoSourceLSTM(nn.Module):
    """Two noisy versions of each frame in, one clean frame out (section "Smoothing Model").

    The faithful network must say every number itself, and what it says need not have length 1.
    Ours adds what the network says to the mean of the two sources, and scales to length 1: it
    starts as good as the mean.

    Parameters
    ----------
    config : TwoSourceConfig
    seed : int, of the first weights
    """

    def __init__(self, config: TwoSourceConfig, *, seed: int):
        super().__init__()
        self.config = config
        n, h = 4 * config.n_joints, config.n_hidden
        with seeded(seed):
            self.encoder = nn.LSTM(2 * n, h, num_layers=config.n_layers, batch_first=True)
            self.decoder = dense([*[h] * config.n_layers, n])
            if not config.faithful:
                start_near(self.decoder, torch.zeros(n))

    def forward(self, a: Tensor, b: Tensor, frame_time: float) -> Tensor:
        """Fuse two sources.

        Parameters
        ----------
        a, b : tensors, shape (B, T, J, 4), unit quaternions
        frame_time : float, seconds; only other networks of this kind use it

        Returns
        -------
        tensor, shape (B, T, J, 4); of length 1 unless the network is faithful
        """
        b = same_side(b, a)
        x, _ = self.encoder(torch.cat([a.flatten(2), b.flatten(2)], dim=-1))  # (B, T, h)
        x = self.decoder(x).view_as(a)  # (B, T, J, 4)
        return x if self.config.faithful else unit((a + b) / 2 + x)


@dataclass(frozen=True)
class PredictionConfig:
    """The shape of a PredictionLSTM."""

    n_joints: int  # J
    n_hidden: int = 128  # LSTM units in each layer; 1000 in the paper
    n_layers: int = 2  # LSTM layers, and dense layers of the decoder
    faithful: bool = False  # the paper's: the pose itself, four raw numbers a joint

    def __post_init__(self) -> None:
        check_sizes(self, "n_joints", "n_hidden", "n_layers")


class PredictionLSTM(nn.Module):
    """Past frames in, the next frames out, one after the other (section "Prediction Model").

    Each predicted frame is the next input. The faithful network says the next pose; ours says
    how the last pose changes, and scales to length 1: it starts as good as standing still,
    which is hard to beat (Martinez et al. 2017).

    Parameters
    ----------
    config : PredictionConfig
    seed : int, of the first weights
    """

    def __init__(self, config: PredictionConfig, *, seed: int):
        super().__init__()
        self.config = config
        n, h = 4 * config.n_joints, config.n_hidden
        with seeded(seed):
            self.encoder = nn.LSTM(n, h, num_layers=config.n_layers, batch_first=True)
            self.decoder = dense([*[h] * config.n_layers, n])
            if not config.faithful:
                start_near(self.decoder, torch.zeros(n))

    def forward(self, past: Tensor, n_future: int = 10, teacher: Tensor | None = None) -> Tensor:
        """Predict the frames that follow.

        Parameters
        ----------
        past : tensor, shape (B, T, J, 4); 50 frames in the paper
        n_future : int
        teacher : tensor, shape (B, n_future, J, 4), or None
            The true frames, to be fed back in place of the predicted ones (teacher forcing).

        Returns
        -------
        tensor, shape (B, n_future, J, 4); of length 1 unless the network is faithful
        """
        x, memory = self.encoder(past.flatten(2))  # (B, T, h)
        last, frames = past[:, -1], []
        for step in range(n_future):
            said = self.decoder(x[:, -1]).view_as(last)  # (B, J, 4)
            frames.append(said if self.config.faithful else unit(last + said))
            last = frames[-1] if teacher is None else teacher[:, step]
            if step + 1 < n_future:
                x, memory = self.encoder(last.flatten(1)[:, None], memory)
        return torch.stack(frames, dim=1)
