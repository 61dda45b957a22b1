"""Everything that changes while a network learns, and the file that keeps it."""

from __future__ import annotations

import json
import math
import os
from typing import Any

import torch
from safetensors.torch import save

from mocaplab.checkpoints import CheckpointError, read_tensors, refuse_damage, tensors_under
from mocaplab.files import write_atomically


def cosine_decay(done: float) -> float:
    """Return the factor of the learning rate, from 1 to 0, when a share of training is done."""
    return 0.5 * (1 + math.cos(math.pi * done))


class TrainingState:
    """A network in training.

    Parameters
    ----------
    network : Module
    weight_decay : float
        Share by which weights shrink, at a learning rate of 1; biases and what belongs to
        single channels do not.
    """

    def __init__(self, network: torch.nn.Module, weight_decay: float = 0.0):
        self.network = network
        parameters = dict(network.named_parameters())
        shrink = {k for k, p in parameters.items() if p.dim() > 1 and "channel_" not in k}
        self.optimizer = torch.optim.AdamW(
            [
                {"params": [parameters[k] for k in parameters if k in shrink]},
                {"params": [parameters[k] for k in parameters if k not in shrink]},
            ],
            fused=True,  # all parameters in one go, which takes a third of the time
        )
        self.optimizer.param_groups[0]["weight_decay"] = weight_decay
        self.optimizer.param_groups[1]["weight_decay"] = 0.0
        self.losses: list[float] = []  # of every epoch so far
        self.validation_losses: list[float] = []  # the same, if there are validation clips
        self.best: dict[str, torch.Tensor] = {}  # the weights at the lowest of these

    def set_learning_rate(self, value: float) -> None:
        """Let the next steps be of this size."""
        for group in self.optimizer.param_groups:
            group["lr"] = value

    def end_epoch(self, loss: float, validation_loss: float | None) -> None:
        """Note the losses of an epoch."""
        self.losses.append(loss)
        if validation_loss is not None:
            if validation_loss < min(self.validation_losses, default=float("inf")):
                self.best = {k: v.clone() for k, v in self.network.state_dict().items()}
            self.validation_losses.append(validation_loss)

    @property
    def epochs_since_best(self) -> int:
        """Epochs since the validation loss was lowest; 0 without validation clips."""
        if not self.validation_losses:
            return 0
        best = self.validation_losses.index(min(self.validation_losses))
        return len(self.validation_losses) - 1 - best

    def save(self, path: str | os.PathLike[str], fingerprint: dict[str, Any]) -> None:
        """Write all that it takes to go on after an interruption."""
        tensors = {f"model.{name}": value for name, value in self.network.state_dict().items()}
        tensors |= {f"best.{name}": value for name, value in self.best.items()}
        for index, values in self.optimizer.state_dict()["state"].items():
            tensors |= {f"adam.{index}.{name}": value for name, value in values.items()}
        tensors = {name: value.contiguous().cpu() for name, value in tensors.items()}
        header = {
            "train": fingerprint,
            "losses": self.losses,
            "validation_losses": self.validation_losses,
        }
        write_atomically(path, save(tensors, {"mocaplab": json.dumps(header)}))

    def load(self, path: str | os.PathLike[str], fingerprint: dict[str, Any]) -> None:
        """Put everything back as it was.

        Raises
        ------
        CheckpointError
            If the file is damaged, or of another training.
        """
        tensors, header = read_tensors(path)
        if header.get("train") != fingerprint:
            raise CheckpointError(
                f"{path} is not the state of this training (other settings or clips); "
                f"remove it to start anew"
            )
        with refuse_damage(path):
            self._put_back(tensors, header)

    def _put_back(self, tensors: dict[str, torch.Tensor], header: dict[str, Any]) -> None:
        self.network.load_state_dict(tensors_under(tensors, "model."))
        self.best = tensors_under(tensors, "best.")
        state = self.optimizer.state_dict()
        for name, value in tensors_under(tensors, "adam.").items():
            index, key = name.split(".")
            state["state"].setdefault(int(index), {})[key] = value
        self.optimizer.load_state_dict(state)
        self.losses, self.validation_losses = header["losses"], header["validation_losses"]
