"""Two processes train the same network as one."""

import subprocess
import sys

import pytest
import torch

from mocaplab.checkpoints import load_checkpoint
from mocaplab.learning.config import TrainConfig
from mocaplab.learning.parallel import mean_over_processes, rank_and_size
from mocaplab.networks import EBFConfig
from mocaplab.training import train

SCRIPT = """
import sys
from mocaplab.checkpoints import save_checkpoint
from mocaplab.datasets import load_dataset
from mocaplab.networks import EBFConfig
from mocaplab.learning.parallel import process_group
from mocaplab.learning.config import TrainConfig
from mocaplab.training import train

clips = load_dataset("embedded").clips[:2]
config = TrainConfig(epochs=2, batch_size=4, n_frames=60)
def network(n):
    return EBFConfig(n, n_hidden=8, dropout=0.0)

with process_group() as (rank, n):
    assert n == 2
    checkpoint = train(clips, config, network, state_path=sys.argv[2], progress=False)
    if rank == 0:
        save_checkpoint(checkpoint, sys.argv[1])
"""


def test_without_torchrun_there_is_one_process():
    assert rank_and_size() == (0, 1)
    value = torch.tensor(2.0, requires_grad=True)
    assert mean_over_processes(value) == 2.0
    assert not mean_over_processes(value).requires_grad


def test_two_processes_train_the_network_that_one_trains(embedded, tmp_path):
    script, out = tmp_path / "two.py", tmp_path / "two.safetensors"
    script.write_text(SCRIPT)
    launch = [sys.executable, "-m", "torch.distributed.run", "--standalone"]
    launch += ["--nproc-per-node", "2", str(script), str(out), str(tmp_path / "state")]
    done = subprocess.run(launch, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    config = TrainConfig(epochs=2, batch_size=4, n_frames=60)

    def network(n):
        return EBFConfig(n, n_hidden=8, dropout=0.0)

    alone = train(embedded.clips[:2], config, network, progress=False)
    together = load_checkpoint(out)
    assert together.info["losses"] == pytest.approx(alone.info["losses"], rel=1e-4)
    for name, value in alone.model.state_dict().items():
        torch.testing.assert_close(together.model.state_dict()[name], value, atol=2e-3, rtol=0)
