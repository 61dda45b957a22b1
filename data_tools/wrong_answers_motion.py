"""Wrong answers to the assignments on motion and noise: see :mod:`wrong_answers`."""

from __future__ import annotations

from data_tools.planted import WrongAnswer

WRONG_ANSWERS_MOTION: dict[str, list[WrongAnswer]] = {}

WRONG_ANSWERS_MOTION["bvh_kinematics"] = [
    WrongAnswer(
        "rest", "", "hand_at_rest = work.motion.skeleton.offsets[4]", "OFFSET of the hand alone"
    ),
    WrongAnswer("rest", "channels[2, :3].copy()", "channels[1, :3].copy()", "the line before"),
    WrongAnswer("rest", "work.motion.channels[2, :3].copy()", "np.zeros(3)", "does not stand at"),
    WrongAnswer(
        "rest", "", "hand_at_rest = forward_kinematics(work.motion)[0][2, 4]", "nothing shall be"
    ),
    WrongAnswer("read", '.split("\\n")[1:]', '.split("\\n")[2:]', "first frame is missing"),
    WrongAnswer("read", "if line.strip()])", "if line.strip()]).T", "turned over"),
    WrongAnswer("read", "if line.strip()])", "if line.strip()]).ravel()", "in one row"),
    WrongAnswer("read", "line.split()]", 'line.split(" ")]', "ValueError"),
    WrongAnswer(
        "position", "+ orientation @ skeleton.offsets", "+ skeleton.offsets", "Turn each one"
    ),
    WrongAnswer(
        "position",
        "orientation @ euler_to_matrix(angles, order)",
        "euler_to_matrix(angles, order) @ orientation",
        "in the wrong order",
    ),
    WrongAnswer("position", "(angles, order)", '(angles, "ZXY")', "its own Euler order"),
    WrongAnswer(
        "position",
        "euler_to_matrix(angles, order)",
        "euler_to_matrix(np.radians(angles), order)",
        "radians where they want degrees",
    ),
    WrongAnswer("speed", " / frame_time", "", "in one frame"),
    WrongAnswer("speed", " / frame_time", " * frame_time", "You multiplied"),
    WrongAnswer("speed", "steps.max(axis=0)", "steps.mean(axis=0)", "mean speed"),
    WrongAnswer("keys", "", "return np.arange(0, 2 * n, 2)", "Not beaten"),
    WrongAnswer("keys", "", "return range(motion.n_frames)", "12 are allowed"),
    WrongAnswer("keys", "", "return np.linspace(0, 1, n)", "whole numbers"),
]

WRONG_ANSWERS_MOTION["rotations"] = [
    WrongAnswer(
        "angles",
        "matrix_to_euler(work.matrix, work.order)",
        "np.radians(matrix_to_euler(work.matrix, work.order))",
        "These are radians",
    ),
    WrongAnswer(
        "angles", "(work.matrix, work.order)", "(work.matrix, work.order[::-1])", "back to front"
    ),
    WrongAnswer("angles", "(work.matrix,", "(work.matrix.T,", "the other way round"),
    WrongAnswer(
        "angles",
        "matrix_to_euler(work.matrix, work.order)",
        'matrix_to_euler(work.matrix, work.order)[[work.order.index(a) for a in "XYZ"]]',
        "in the wrong places",
    ),
    WrongAnswer("between", "np.degrees(np.arccos", "(np.arccos", "These are radians"),
    WrongAnswer("between", "a.T @ b", "a @ b", "You multiplied the two"),
    WrongAnswer("between", "np.clip(cosine, -1, 1)", "cosine", "np.clip"),
    WrongAnswer("between", "", "return np.linalg.norm(a - b)", "not an angle"),
    WrongAnswer(
        "side",
        "",
        "before = np.concatenate([q[:1], q[:-1]])\n"
        "return np.where(np.sum(q * before, axis=1, keepdims=True) < 0, -q, q)",
        "as it was",
    ),
    WrongAnswer("side", "", "return np.where(q[:, :1] < 0, -q, q)", "w positive"),
    WrongAnswer("side", "q[frame] @ q[frame - 1]", "q[frame] @ q[0]", "the first frame"),
    WrongAnswer("side", "", "return np.abs(q)", "as a whole"),
    WrongAnswer("slerp", "", "return (1 - t) * start + t * end", "a straight line: its points"),
    WrongAnswer(
        "slerp", "", "q = (1 - t) * start + t * end\nreturn q / np.linalg.norm(q)", "not evenly"
    ),
    WrongAnswer("slerp", "if cosine < 0:", "if False:", "the long way"),
    WrongAnswer("slerp", "if cosine > 1 - 1e-9:", "if False:", "0 / 0 is NaN"),
    WrongAnswer("inbetween", "", "return keys", "from the first key to the last"),
    WrongAnswer("inbetween", "", "return slerp_between_keys(keys, step)", "Not beaten"),
    WrongAnswer("inbetween", "keys = align_hemisphere(keys)", "pass", "Not beaten"),
]

WRONG_ANSWERS_MOTION["noise_gaps"] = [
    WrongAnswer("snr", "10 * np.log10", "20 * np.log10", "powers already"),
    WrongAnswer("snr", "10 * np.log10", "10 * np.log", "base 10"),
    WrongAnswer("snr", " - clean[:, moves].mean(axis=0)", "", "mean away first"),
    WrongAnswer(
        "snr",
        "np.sum(movement**2) / np.sum(noise**2)",
        "np.sum(noise**2) / np.sum(movement**2)",
        "turned the ratio over",
    ),
    WrongAnswer("noise", "(-snr_db / 20)", "(-snr_db / 10)", "ratio of powers"),
    WrongAnswer("noise", "values.std(axis=0)", "values.std()", "each channel's own deviation"),
    WrongAnswer("noise", "rng.normal(", "np.random.default_rng().normal(", "Draw every number"),
    WrongAnswer("noise", "(-snr_db / 20)", "(snr_db / 20)", "louder than the signal"),
    WrongAnswer(
        "gap", "observed_now, 0, length + 1", "observed_now, length + 1, 0", "observed runs"
    ),
    WrongAnswer("gap", "longest * frame_time", "longest", "These are frames"),
    WrongAnswer("gap", "np.maximum(longest, length)", "longest + ~observed_now", "in all gaps"),
    WrongAnswer(
        "gap",
        "",
        "longest = np.zeros(mask.shape[1])\nlength = np.zeros(mask.shape[1])\n"
        "for seen in mask:\n    longest = np.where(seen, np.maximum(longest, length), longest)\n"
        "    length = np.where(seen, 0, length + 1)\nreturn longest * frame_time",
        "nothing ends it",
    ),
    WrongAnswer("split", "np.nanstd(error, axis=0)", "np.nanmean(error**2, axis=0) ** 0.5", "RMS"),
    WrongAnswer(
        "split",
        "np.nanmean(error, axis=0), np.nanstd(error, axis=0)",
        "np.nanmean(error, axis=1), np.nanstd(error, axis=1)",
        "over the frames",
    ),
    WrongAnswer(
        "split",
        "np.nanmean(error, axis=0), np.nanstd(error, axis=0)",
        "error.mean(axis=0), error.std(axis=0)",
        "leave the hidden samples out",
    ),
    WrongAnswer(
        "split",
        "np.nanmean(error, axis=0), np.nanstd(error, axis=0)",
        "np.nan_to_num(error).mean(axis=0), np.nan_to_num(error).std(axis=0)",
        "They say nothing",
    ),
    WrongAnswer("blind", "", "return values.std(axis=0)", "Not beaten"),
    WrongAnswer("blind", "np.diff(values, 3, axis=0)", "np.diff(values, 3)", "deviations."),
    WrongAnswer(
        "blind",
        "3, axis=0).std(axis=0) / np.sqrt(20)",
        "2, axis=0).std(axis=0) / 6**0.5",
        "half of the points",
        10.0,
    ),
]
