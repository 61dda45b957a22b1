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


class State:
    """What an LSTM direction hands from frame to frame, and room to compute the next.

    All stands side by side in one array, so that a frame takes few calls of numpy: with a
    hundred units a call costs more than what it computes.
    """

    def __init__(self, n_hidden: int):
        self.output = np.zeros(n_hidden, np.float32)
        room = np.zeros(5 * n_hidden, np.float32)  # cell, candidate, keep, let in, let out
        self.gates = room[n_hidden:]  # all but the cell
        self.sigmoids = room[2 * n_hidden :]
        self.cell, self.let_out = room[:n_hidden], room[4 * n_hidden :]
        self.cell_and_candidate = room[: 2 * n_hidden]
        self.keep_and_let_in = room[2 * n_hidden : 4 * n_hidden]


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
            # From torch's order (input, forget, candidate, output) to that of a state.
            # sigmoid(x) = (1 + tanh(x / 2)) / 2, so that one tanh serves all four.
            let_in, keep, candidate, let_out = np.split(array, 4)
            return np.concatenate([candidate, keep / 2, let_in / 2, let_out / 2]).T.copy()

        self.from_input = values("weight_ih")  # (n_in, 4h)
        self.from_state = values("weight_hh")  # (h, 4h)
        self.bias = values("bias_ih") + values("bias_hh")  # (4h,)
        self.n_hidden = len(self.from_state)

    def project(self, x: Float32Array) -> Float32Array:
        """Return what comes from the input, shape (..., 4h): the part that needs no state."""
        projected: Float32Array = x @ self.from_input + self.bias
        return projected

    def step(self, projected: Float32Array, state: State) -> Float32Array:
        """Bring the state forward by one frame, and return its output, shape (h,)."""
        np.dot(state.output, self.from_state, out=state.gates)
        state.gates += projected
        np.tanh(state.gates, out=state.gates)
        state.sigmoids *= 0.5
        state.sigmoids += 0.5
        kept, new = (state.keep_and_let_in * state.cell_and_candidate).reshape(2, -1)
        np.add(kept, new, out=state.cell)
        state.output = state.let_out * np.tanh(state.cell)
        return state.output

    def run(self, projected: Float32Array) -> Float32Array:
        """Go over some frames from a state of zeros, shape (n, 4h); return all outputs, (n, h)."""
        state = State(self.n_hidden)
        return np.array([self.step(each, state) for each in projected])


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
        self.states = [State(direction.n_hidden) for direction in self.forward]
        self.n_hidden = lstm.hidden_size
        # Of the frames from the one to clean up to the newest: what they give to the first
        # backward pass, and the output of the first forward pass.
        self.projected: deque[Float32Array] = deque(maxlen=look_ahead + 1)
        self.first_outputs: deque[Float32Array] = deque(maxlen=look_ahead + 1)

    def observe(self, code: Float32Array) -> None:
        """Take note of the newest frame, shape (n_in,)."""
        self.projected.append(self.backward[0].project(code))
        projected = self.forward[0].project(code)
        self.first_outputs.append(self.forward[0].step(projected, self.states[0]))

    def oldest(self) -> Float32Array:
        """Return the output for the oldest frame that is kept, shape (2h,), and forget it."""
        back = self.backward[0].run(np.array(self.projected)[::-1])  # from the newest on
        both = np.concatenate([np.array(self.first_outputs)[::-1], back], axis=1)  # (n, 2h)
        front = self.forward[1].step(self.forward[1].project(both[-1]), self.states[1])
        back = self.backward[1].run(self.backward[1].project(both))
        self.projected.popleft()
        self.first_outputs.popleft()
        return np.concatenate([front, back[-1]])
