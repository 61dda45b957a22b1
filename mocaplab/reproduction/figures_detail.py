"""Not in the paper: the error of every joint, and by speed of the motion."""

from __future__ import annotations

import numpy as np

from mocaplab.comparison.bootstrap import Interval
from mocaplab.motion import FloatArray, Motion, moving_channels
from mocaplab.reproduction.claims import Claim, Evidence, make_claim
from mocaplab.reproduction.figure import Drawing, Figure, Row, new_picture
from mocaplab.reproduction.needs import Need
from mocaplab.reproduction.plots import style_of
from mocaplab.reproduction.scores import label_of

DETAILED = ("ebf", "gaussian_58", "gaussian_tuned", "blend")
SPEED_BINS = 8


def _draw_joints(evidence: Evidence) -> Drawing:
    names = evidence.dataset.skeleton.joint_names
    picture, (ax,) = new_picture(width=11, height=4.2)
    rows: list[Row] = []
    shown: list[int] | None = None
    for number, method in enumerate(DETAILED):
        method = evidence.plan.headline(method)
        found = [
            row["by_joint_deg"] for row in evidence.scores.rows(method) if "by_joint_deg" in row
        ]
        if not found:
            continue
        errors = np.sqrt(np.mean(np.square(found), axis=0))
        if shown is None:
            shown = [int(j) for j in np.argsort(-errors) if errors[j] > 1e-6]
        color, line = style_of(method, number)
        ax.plot(errors[shown], line, marker=".", color=color, label=label_of(method))
        rows += [
            {"joint": names[j], "method": label_of(method), "rms_deg": errors[j]} for j in shown
        ]
    ax.set_xticks(range(len(shown or [])), [names[j] for j in shown or []], rotation=90)
    ax.set_ylim(0, None)
    ax.set_ylabel("RMS error, degrees")
    ax.legend()
    return rows, picture


def joint_speed(clip: Motion) -> FloatArray:
    """Measure how fast a clip moves: RMS speed over the angles that move, (T,), degrees/s."""
    moves = moving_channels(clip)
    speed = np.gradient(clip.channels[:, moves], clip.frame_time, axis=0)
    result: FloatArray = np.sqrt(np.mean(speed**2, axis=1))
    return result


def _by_speed(evidence: Evidence, method: str) -> tuple[FloatArray, FloatArray]:
    """Return speeds and squared errors of all frames of all test clips, in degrees."""
    clips = {clip.name: clip for clip in evidence.dataset.clips}
    rows = [row for row in evidence.scores.rows(method) if "by_frame_deg" in row]
    if not rows:
        return np.zeros(0), np.zeros(0)
    speed = np.concatenate([joint_speed(clips[row["clip"]]) for row in rows])
    return speed, np.concatenate([np.square(row["by_frame_deg"]) for row in rows])


def _draw_speed(evidence: Evidence) -> Drawing:
    picture, (ax,) = new_picture(width=7)
    rows: list[Row] = []
    for number, method in enumerate(DETAILED):
        method = evidence.plan.headline(method)
        speed, square = _by_speed(evidence, method)
        if not speed.size:
            continue
        edges = np.quantile(speed, np.linspace(0, 1, SPEED_BINS + 1))
        bins = np.digitize(speed, edges[1:-1])
        means = [(speed[bins == b].mean(), np.sqrt(square[bins == b].mean())) for b in
                 range(SPEED_BINS) if (bins == b).any()]  # fmt: skip
        color, line = style_of(method, number)
        ax.plot(*zip(*means, strict=True), line, marker=".", color=color, label=label_of(method))
        rows += [
            {"method": label_of(method), "speed_deg_s": s, "rms_deg": error} for s, error in means
        ]
    ax.set_ylim(0, None)
    ax.set(xlabel="speed of the joints, degrees a second", ylabel="RMS error, degrees")
    ax.legend()
    return rows, picture


def _claims_speed(evidence: Evidence) -> list[Claim]:
    ours, theirs = (_by_speed(evidence, evidence.plan.headline(m)) for m in ("ebf", "gaussian_58"))
    if not ours[0].size or ours[0].shape != theirs[0].shape:
        return []
    fast = ours[0] > np.quantile(ours[0], 0.75)
    ratio = float(np.sqrt(ours[1][fast].mean() / theirs[1][fast].mean()))
    n = len(evidence.scores.by_clip(evidence.plan.headline("ebf")))
    text = "EBF against the Gaussian of 58 ms in the fastest quarter of all frames"
    found = Interval(ratio, ratio, ratio)
    name = evidence.plan.headline("ebf")
    return [make_claim(evidence, "speed", text, "-", found, "times", n, (name,), None)]


def _nothing(evidence: Evidence) -> list[Claim]:
    return []


_detail = Need(DETAILED, headline=True, detail=True)
DETAIL = (
    Figure(
        "joints",
        "Not in the paper: error of every joint",
        "Which joints are hardest? Is EBF better at all of them?",
        (_detail,),
        _draw_joints,
        _nothing,
    ),
    Figure(
        "speed",
        "Not in the paper: error by speed of the motion",
        "Where does a fixed Gaussian lose: in fast movements or in slow ones?",
        (_detail,),
        _draw_speed,
        _claims_speed,
    ),
)
