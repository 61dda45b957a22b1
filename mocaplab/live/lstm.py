"""LSTM layers for a stream, in numpy: for one frame at a time it is faster than torch.

A backward pass begins at the end of a clip. A stream has no end, so here it begins at the newest
frame, ``look_ahead`` frames after the one to clean, and is done anew for every frame. The forward
pass goes on from the state that it is in.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray
from torch import nn

Float32Array = NDArray[np.float32]
State = tuple[Float32Array, Float32Array]


class Direction:
    """One direction of one layer of a trained LSTM.

    Parameters
    ----------
    lstm : torch.nn.LSTM
    layer : int
    reverse : bool
    """

    def __init__(self, lstm: nn.LSTM, layer: int, *, reverse: bool):
        suffix = f"_l{layer}" + ("_reverse" if reverse else "")

        def values(name: str) -> Float32Array:
            array: Float32Array = getattr(lstm, name + suffix).detach().numpy()
            # From torch's order (input, forget, candidate, output) to one with the three that
            # take a sigmoid side by side. sigmoid(x) = (1 + tanh(x / 2)) / 2, so that one tanh
            # serves all four.
            gate_in, forget, candidate, gate_out = np.split(array, 4)
            return np.concatenate([gate_in / 2, forget / 2, gate_out / 2, candidate]).T.copy()

        self.from_input = values("weight_ih")  # (n_in, 4h)
        self.from_state = values("weight_hh")  # (h, 4h)
        self.bias = values("bias_ih") + values("bias_hh")  # (4h,)
        self.n_hidden = len(self.from_state)

    def start(self) -> State:
        """Return the state before the first frame: all zeros."""
        return np.zeros(self.n_hidden, np.float32), np.zeros(self.n_hidden, np.float32)

    def project(self, x: Float32Array) -> Float32Array:
        """Return what comes from the input, shape (..., 4h): the part that needs no state."""
        projected: Float32Array = x @ self.from_input + self.bias
        return projected

    def step(self, projected: Float32Array, state: State) -> State:
        """Go on by one frame; the first array of the state is the output, shape (h,)."""
        output, cell = state
        gates = output @ self.from_state
        gates += projected
        np.tanh(gates, out=gates)
        sigmoids, candidate = gates[: -self.n_hidden], gates[-self.n_hidden :]
        sigmoids *= 0.5
        sigmoids += 0.5
        open_in, keep, open_out = sigmoids.reshape(3, -1)
        cell = keep * cell + open_in * candidate
        return open_out * np.tanh(cell), cell

    def run(self, projected: Float32Array) -> Float32Array:
        """Go over some frames from the start, shape (n, 4h); return all outputs, (n, h)."""
        state, outputs = self.start(), []
        for each in projected:
            state = self.step(each, state)
            outputs.append(state[0])
        return np.array(outputs)


class LiveLSTM:
    """A bidirectional LSTM of two layers that sees ``look_ahead`` frames ahead.

    What comes from a frame alone is computed once, when it arrives.

    Parameters
    ----------
    lstm : torch.nn.LSTM, from :func:`mocaplab.layers.bidirectional_lstm`
    look_ahead : int, frames
    """

    def __init__(self, lstm: nn.LSTM, look_ahead: int):
        self.forward = [Direction(lstm, layer, reverse=False) for layer in range(2)]
        self.backward = [Direction(lstm, layer, reverse=True) for layer in range(2)]
        self.states = [direction.start() for direction in self.forward]
        self.n_hidden = lstm.hidden_size
        # Of the frames from the one to clean up to the newest: what they give to the first
        # backward pass, and the output of the first forward pass.
        self.projected: deque[Float32Array] = deque(maxlen=look_ahead + 1)
        self.first_outputs: deque[Float32Array] = deque(maxlen=look_ahead + 1)

    def observe(self, code: Float32Array) -> None:
        """Take note of the newest frame, shape (n_in,)."""
        self.projected.append(self.backward[0].project(code))
        self.states[0] = self.forward[0].step(self.forward[0].project(code), self.states[0])
        self.first_outputs.append(self.states[0][0])

    def oldest(self) -> Float32Array:
        """Return the output for the oldest frame that is kept, shape (2h,), and forget it."""
        back = self.backward[0].run(np.array(self.projected)[::-1])  # from the newest on
        both = np.concatenate([np.array(self.first_outputs)[::-1], back], axis=1)  # (n, 2h)
        self.states[1] = self.forward[1].step(self.forward[1].project(both[-1]), self.states[1])
        back = self.backward[1].run(self.backward[1].project(both))
        self.projected.popleft()
        self.first_outputs.popleft()
        return np.concatenate([self.states[1][0], back[-1]])
