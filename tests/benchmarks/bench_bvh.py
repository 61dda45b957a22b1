"""Time reading, forward kinematics and writing of BVH against other libraries.

    python tests/benchmarks/bench_bvh.py [FILES]

Prints Markdown tables of ratios of CPU seconds (medians; ours and theirs take turns).
Without FILES it takes three clips under $MOCAPLAB_DATA, or else clips of the embedded set.
A peer whose world positions differ from ours by 1e-3 or more is "wrong", one that raises
"fails", one that has no such function "-".
"""

from __future__ import annotations

import argparse
import io
import os
import statistics
import tempfile
import time
import warnings
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from mocaplab.bvh import load_bvh, save_bvh
from mocaplab.datasets import load_dataset
from mocaplab.kinematics import forward_kinematics

CLIPS = ("cmu/walk_01.bvh", "cmu/jump_03.bvh", "cmu_daz/salsa_10.bvh")
SLOW_S = 0.5  # what takes longer than this is timed once
Task = Callable[[Any], Any]


def cpu_seconds(task: Task, argument: Any) -> float:
    start = time.process_time()
    task(argument)
    return time.process_time() - start


# Each peer: its module, and how it reads a path, and from what it read finds world
# positions (T, J, 3) of the joints, and writes to a path.


def pybvh_read(path: str) -> Any:
    return import_module("pybvh").read_bvh_file(path)


def pybvh_read_up(path: str) -> Any:
    """Told which way is up, it need not find out, which takes it a fifth of the time."""
    return import_module("pybvh").read_bvh_file(path, world_up="+y")


def pybvh_write(clip: Any, path: str) -> None:
    import_module("pybvh").write_bvh_file(clip, path)


def bvhio_read(path: str) -> Any:
    return import_module("bvhio").readAsBvh(path)


def bvhio_positions(clip: Any) -> Any:
    root = import_module("bvhio").convertBvhToHierarchy(clip.Root)
    joints = [joint for joint, _, _ in root.layout()]
    frames = []
    for frame in range(clip.FrameCount):
        root.loadPose(frame)
        frames.append([list(joint.PositionWorld) for joint in joints])
    return np.array(frames)


def bvhio_write(clip: Any, path: str) -> None:
    import_module("bvhio").writeBvh(path, clip)


def bvhsdk_read(path: str) -> Any:
    return import_module("bvhsdk.bvh").ReadFile(path)


def bvhsdk_write(clip: Any, path: str) -> None:
    folder = str(Path(path).parent)
    import_module("bvhsdk.bvh").WriteBVH(clip, folder, name="bvhsdk", refTPose=False)


def bvhtoolbox_read(path: str) -> Any:
    return import_module("bvhtoolbox").BvhTree(Path(path).read_text())


def bvh_read(path: str) -> Any:
    return import_module("bvh").Bvh(Path(path).read_text())


def pymotion_read(path: str) -> Any:
    clip = import_module("pymotion.io.bvh").BVH()
    clip.load(path)
    return clip


def pymotion_positions(clip: Any) -> Any:
    turns, positions, parents, offsets, *_ = clip.get_data()
    kinematics = import_module("pymotion.ops.skeleton").fk
    return kinematics(turns, positions[:, 0], offsets, parents)[0]


PEERS: dict[str, tuple[Task, Task | None, Callable[[Any, str], Any] | None]] = {
    "pybvh": (pybvh_read, lambda clip: clip.joint_positions(), pybvh_write),
    "pybvh (told +y)": (pybvh_read_up, lambda clip: clip.joint_positions(), pybvh_write),
    "bvhio": (bvhio_read, bvhio_positions, bvhio_write),
    "bvhsdk": (bvhsdk_read, lambda clip: clip.getJointPositions(), bvhsdk_write),
    "bvhtoolbox": (bvhtoolbox_read, None, lambda clip, path: clip.write_file(path)),
    "bvhtools": (lambda path: import_module("bvhtools").load(path), None, None),
    "bvh": (bvh_read, None, None),
    "pymotion": (pymotion_read, pymotion_positions, lambda clip, path: clip.save(path)),
}


def race(ours: Task, theirs: Task, fresh: Callable[[], Any], mine: Any, repeats: int) -> float:
    """CPU seconds of theirs by ours; they get a fresh argument, as some keep results."""
    pairs = []
    for _ in range(repeats):
        pairs.append((cpu_seconds(ours, mine), cpu_seconds(theirs, fresh())))
        if pairs[0][1] > SLOW_S:
            break
    own, other = (statistics.median(column) for column in zip(*pairs, strict=True))
    return other / own


def compare(path: str, peer: str, scratch: str, repeats: int) -> list[str]:
    """Times of a peer in units of ours: reading, forward kinematics, writing."""
    read, positions, write = PEERS[peer]
    motion, out = load_bvh(path), str(Path(scratch) / "out.bvh")
    try:
        clip = read(path)
        cells = [f"{race(load_bvh, read, lambda: path, path, repeats):.2f}"]
    except Exception:
        return ["fails", "fails", "fails"]

    def again() -> Any:
        return read(path)

    def save_ours(motion: Any) -> None:
        save_bvh(motion, out)

    try:
        if positions is None:
            cells.append("-")
        else:
            found = np.asarray(positions(clip))
            expected = forward_kinematics(motion)[0]
            right = found.shape == expected.shape and np.abs(found - expected).max() < 1e-3
            ratio = race(forward_kinematics, positions, again, motion, repeats)
            cells.append(f"{ratio:.2f}" if right else "wrong")
    except Exception:
        cells.append("fails")
    try:
        if write is None:
            cells.append("-")
        else:
            ratio = race(save_ours, lambda clip: write(clip, out), again, motion, repeats)
            cells.append(f"{ratio:.2f}")
    except Exception:
        cells.append("fails")
    return cells


def parse_pandas(text: str) -> Any:
    reader = import_module("pandas").read_csv
    frame = reader(io.StringIO(text), sep=" ", header=None, float_precision="round_trip")
    return frame.to_numpy()


def parse_simdjson(text: str) -> Any:
    array = b"[" + text.strip().replace(" ", ",").replace("\n", ",").encode() + b"]"
    parser = import_module("simdjson").Parser()
    return np.frombuffer(parser.parse(array).as_buffer(of_type="d"))


def parse_orjson(text: str) -> Any:
    array = b"[" + text.strip().replace(" ", ",").replace("\n", ",").encode() + b"]"
    return np.array(import_module("orjson").loads(array), dtype=np.float64)


FLOATS: dict[str, Task] = {
    "float list": lambda text: np.array([float(word) for word in text.split()]),
    "np.fromstring": lambda text: np.fromstring(text, sep=" "),
    "np.loadtxt": lambda text: np.loadtxt(text.splitlines()),
    "orjson": parse_orjson,
    "simdjson": parse_simdjson,
    "pandas": parse_pandas,
}


def compare_floats(path: str, route: str, repeats: int) -> str:
    """Our whole reading in units of parsing the motion block's floats alone."""
    text = Path(path).read_text(encoding="latin-1").expandtabs(1)
    text = text[text.index("\n", text.lower().index("frame time")) + 1 :]
    text = "\n".join(line.strip() for line in text.split("\n"))
    try:
        values = np.asarray(FLOATS[route](text)).ravel()
        if values.tobytes() != load_bvh(path).channels.tobytes():
            return "wrong"
        return f"{1 / race(load_bvh, FLOATS[route], lambda: text, path, repeats):.2f}"
    except ImportError:
        return "not installed"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("files", nargs="*")
    parser.add_argument("--repeats", type=int, default=15)
    options = parser.parse_args()
    folder = os.environ.get("MOCAPLAB_DATA")
    with tempfile.TemporaryDirectory() as scratch:
        files = options.files or [str(Path(folder or "") / clip) for clip in CLIPS]
        if not (options.files or folder):
            files = []
            embedded = load_dataset("embedded")
            for name in ("walk_01", "jump_01", "run_01"):
                motion = embedded[name]
                files.append(str(Path(scratch) / f"{name}.bvh"))
                save_bvh(motion, files[-1])
        print("Times of each peer in units of ours; in brackets ours in units of the peer's.\n")
        print("| file | peer | read | forward kinematics | write |\n|---|---|---|---|---|")
        for path in files:
            for peer in PEERS:
                cells = ["not installed"] * 3
                if find_spec(peer.split()[0]):
                    with redirect_stdout(io.StringIO()):  # some talk while they work
                        cells = compare(path, peer, scratch, options.repeats)
                for i, cell in enumerate(cells):
                    with suppress(ValueError):
                        cells[i] = f"{cell} ({1 / float(cell):.2f})"
                print(f"| {Path(path).stem} | {peer} | {' | '.join(cells)} |", flush=True)
        print("\nReading a whole file, in units of parsing its floats alone.\n")
        print(f"| file | {' | '.join(FLOATS)} |\n|---|{'---|' * len(FLOATS)}")
        for path in files:
            ratios = [compare_floats(path, route, options.repeats) for route in FLOATS]
            print(f"| {Path(path).stem} | {' | '.join(ratios)} |", flush=True)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main()
