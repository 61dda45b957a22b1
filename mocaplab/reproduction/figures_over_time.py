"""Paper A's figures 3 and 4: the shapes of free kernels, and errors over time."""

from __future__ import annotations

from functools import partial

import numpy as np

from mocaplab.comparison.bootstrap import Interval
from mocaplab.noise.draws import draw_test
from mocaplab.reproduction.claims import Claim, Evidence, make_claim
from mocaplab.reproduction.figure import Drawing, Figure, Row, named, new_picture
from mocaplab.reproduction.needs import NOISE, PAPERS, Need
from mocaplab.reproduction.networks_inside import gaussian_share, kernels_of
from mocaplab.reproduction.plots import plot_by_frame, plot_kernels, style_of
from mocaplab.reproduction.scores import label_of
from mocaplab.reproduction.verdicts import judge_at_least


def _free_kernels(evidence: Evidence) -> list[tuple[str, str, np.ndarray]]:
    """Predict the free kernels of a walk, a run and a jump of the first holdout, or of others."""
    jobs = [job for job in evidence.scores.results if job.method == "ebf_free"]
    if not jobs:
        return []
    job, wanted = jobs[0], ["walk", "run", "jump"]
    clips = {evidence.dataset.actions[i]: i for i in reversed(job.split.test)}
    chosen = sorted(clips, key=lambda a: wanted.index(a) if a in wanted else len(wanted))[:3]
    model = evidence.models / f"{job.network_name}.safetensors"
    found = []
    for action in chosen:
        clip = evidence.dataset.clips[clips[action]]
        kernels = kernels_of(model, draw_test(clip, NOISE, seed=job.seed, repetition=0))
        found.append((clip.name, action, kernels[15:-15]))  # whole windows alone
    return found


def _draw_3(evidence: Evidence) -> Drawing | None:
    found = _free_kernels(evidence)
    if not found:
        return None
    picture, axes = new_picture(len(found), width=4.0, height=3.4)
    rows: list[Row] = []
    for (name, action, kernels), ax in zip(found, axes, strict=True):
        overlap, sigma = gaussian_share(kernels)
        shown = np.linspace(0, len(kernels) - 1, min(12, len(kernels))).round().astype(int)
        plot_kernels(kernels[shown], f"{action}: {name}", ax)
        rows += [
            {
                "clip": name,
                "action": action,
                "frame": 15 + int(i),
                "overlap_with_gaussian": overlap[i],
                "sigma_frames": sigma[i],
                **{f"tap_{k - 15:+d}": w for k, w in enumerate(kernels[i])},
            }
            for i in shown
        ]
    return rows, picture


def _claims_3(evidence: Evidence) -> list[Claim]:
    found = _free_kernels(evidence)
    shares = [gaussian_share(kernels) for _, _, kernels in found]
    overlap = np.concatenate([o for o, _ in shares]) if shares else np.array([np.nan])
    sigma = np.concatenate([s for _, s in shares]) if shares else np.array([np.nan])
    low, middle, high = np.percentile(overlap, [2.5, 50, 97.5])
    ours = Interval(float(middle), float(low), float(high))
    n = 6 if found else 0  # frames count here, not clips
    widths = Interval(*(float(x) for x in np.percentile(sigma, [50, 2.5, 97.5])))
    claim = partial(make_claim, evidence, "3")
    return [
        claim(
            "free kernels look Gaussian",
            "essentially Gaussian",
            ours,
            "of a kernel's area is a Gaussian's (median and range of frames; ours start as "
            "Gaussians, which helps)",
            n,
            ["ebf_free"],
            lambda: judge_at_least(ours.value, 0.9, 0.75),
        ),
        claim(
            "width of the nearest Gaussian",
            "-",
            widths,
            "frames (median and range of frames)",
            n,
            ["ebf_free"],
            None,
        ),
    ]


def _draw_4(evidence: Evidence) -> Drawing | None:
    scores = evidence.scores
    first = next(iter(evidence.groups["holdout"].values()))
    names = {evidence.dataset.clips[i].name for i in first.test}
    methods = named(evidence, (*PAPERS, "ebf", "gaussian_tuned", "blend"))
    tested = [scores.by_clip(method) for method in methods]
    clips = [clip for clip in scores.numbered(tested) if clip in names][:8]
    if not clips:
        return None
    n_columns = min(4, len(clips))
    picture, axes = new_picture(n_columns, -(-len(clips) // n_columns), width=4.2, height=2.8)
    rows: list[Row] = []
    for clip, ax in zip(clips, axes, strict=False):
        lines = {}
        for number, method in enumerate(methods):
            errors = next(
                np.array(row["by_frame_deg"])
                for row in scores.rows(method)
                if row["clip"] == clip and row["repetition"] == 0
            )
            lines[label_of(method)] = (errors, *style_of(method, number))
            rows += [
                {"clip": clip, "method": label_of(method), "frame": frame, "rms_deg": float(e)}
                for frame, e in enumerate(errors)
            ]
        plot_by_frame(lines, f"{scores.actions[clip]}: {clip}", ax)
    for ax in axes[len(clips) :]:
        ax.set_visible(False)
    picture.legend(*axes[0].get_legend_handles_labels(), loc="outside right upper")
    return rows, picture


def _share_of_frames(evidence: Evidence, ours: str, others: list[str]) -> tuple[Interval, int]:
    """Count the frames in which a method is best, clip by clip; the mean over clips."""
    shares: dict[str, list[float]] = {}
    for row in evidence.scores.rows(ours):
        key = (row["clip"], row["repetition"])
        rivals = [
            other["by_frame_deg"]
            for method in others
            for other in evidence.scores.rows(method)
            if (other["clip"], other["repetition"]) == key and "by_frame_deg" in other
        ]
        if len(rivals) == len(others) and "by_frame_deg" in row:
            best = np.array(row["by_frame_deg"]) < np.min(rivals, axis=0)
            shares.setdefault(row["clip"], []).append(float(best.mean()))
    means = {clip: float(np.mean(values)) for clip, values in shares.items()}
    return evidence.scores.mean(means), len(means)


def _claims_4(evidence: Evidence) -> list[Claim]:
    ebf = evidence.plan.headline("ebf")
    papers, honest = list(PAPERS), ["gaussian_tuned"]
    found = []
    for others, text, said in (
        (papers, "EBF has the lowest error over time, of the paper's methods", "in all plots"),
        (honest, "frames in which EBF beats the tuned Gaussian", "-"),
    ):
        share, n = _share_of_frames(evidence, ebf, others)
        judge = None if said == "-" else partial(judge_at_least, share.value, 0.9, 0.5)
        found.append(
            make_claim(evidence, "4", text, said, share, "of the frames", n, (ebf, *others), judge)
        )
    return found


OVER_TIME = (
    Figure(
        "3",
        "Figure 3: the shapes of free kernels",
        "Do filters of any shape come out as Gaussians? Ours start as Gaussians: look at sigma.",
        (Need(("ebf_free",)),),
        _draw_3,
        _claims_3,
    ),
    Figure(
        "4",
        "Figure 4: error over time, 8 motions of the first holdout",
        "Where in a motion is each method worst? Is EBF best in every frame, or on average?",
        (Need((*PAPERS, "ebf", "gaussian_tuned", "blend"), headline=True, detail=True),),
        _draw_4,
        _claims_4,
    ),
)
