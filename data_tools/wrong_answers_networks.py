"""Wrong answers to the assignments on smoothing and networks: see :mod:`wrong_answers`."""

from __future__ import annotations

from data_tools.planted import WrongAnswer

WRONG_ANSWERS_NETWORKS: dict[str, list[WrongAnswer]] = {}

WRONG_ANSWERS_NETWORKS["smoothing"] = [
    WrongAnswer("sigma", "work.width_ms / 1000 /", "work.width_ms /", "in milliseconds"),
    WrongAnswer("sigma", " / (2 * np.sqrt(2 * np.log(2)))", "", "How many sigma is it"),
    WrongAnswer("sigma", "/ (2 * np.sqrt(2 * np.log(2)))", "* 2.3548", "narrower than the width"),
    WrongAnswer("sigma", "/ (2 * np.sqrt(2 * np.log(2)))", "/ 2.3548 * work.fps", "in frames"),
    WrongAnswer("peak", "100 * (1 -", "1 * (1 -", "That is a share"),
    WrongAnswer("peak", "100 * (1 - fastest / wanted)", "100 * fastest / wanted", "what is left"),
    WrongAnswer(
        "peak",
        "np.abs(np.diff(smooth)).max(), np.abs(np.diff(clean)).max()",
        "np.diff(smooth).max(), np.diff(clean).max()",
        "negative velocity",
    ),
    WrongAnswer(
        "peak",
        "np.abs(np.diff(smooth)).max(), np.abs(np.diff(clean)).max()",
        "np.abs(smooth).max(), np.abs(clean).max()",
        "of the largest angle",
    ),
    WrongAnswer("window", "weights / weights.sum()", "weights", "divide them by their sum"),
    WrongAnswer(
        "window", "sigma = sigma_s / frame_time", "sigma = sigma_s", "divide it by the frame"
    ),
    WrongAnswer("window", "(taps / sigma) ** 2", "taps**2 / sigma", "sigma squared"),
    WrongAnswer("window", "-0.5 * (taps / sigma) ** 2", "-((taps / sigma) ** 2)", "factor 1/2"),
    WrongAnswer("gaps", "total / weight", "total", "count as 0"),
    WrongAnswer("gaps", "np.where(mask, values, 0.0)", "values * mask", "NaN times 0 is NaN"),
    WrongAnswer("gaps", "mask.astype(float)", "np.ones(len(mask))", "weights of all frames"),
    WrongAnswer("gaps", "total =", "mask = ~mask\n    total =", "True in the mask means"),
    WrongAnswer("honest", "np.argmin(others.sum(axis=0))", "np.argmin(errors[i])", "clip itself"),
    WrongAnswer("honest", "others.sum(axis=0)", "errors.sum(axis=0)", "the one under test too"),
    WrongAnswer(
        "honest",
        "np.sqrt(errors[i, width] / n_samples[i])",
        "errors[i, width] / n_samples[i]",
        "mean squares",
    ),
    WrongAnswer(
        "honest", "np.sqrt(errors[i, width] / n_samples[i])", "width", "Those are the widths"
    ),
    WrongAnswer("clean", "", "return observed", "Not beaten"),
    WrongAnswer("clean", "", "return single_gaussian(observed)", "Not beaten"),
    WrongAnswer("clean", "", "return observed.channels", "Return a motion"),
    WrongAnswer(
        "clean",
        "fit_wiener([clip for seed in (1, 2) for clip in contest_clips(seed)])",
        "GaussianDenoiser(tune_gaussian(contest_clips(1) + contest_clips(2))[1])",
        "NameError",
    ),
]

WRONG_ANSWERS_NETWORKS["filter_ebf"] = [
    WrongAnswer("hand", " / (w + 1 + w)", "", "do not add up to 1"),
    WrongAnswer(
        "hand", "np.exp(-1 / (2 * work.sigma**2))", "np.exp(-1 / (2 * work.sigma))", "sigma squared"
    ),
    WrongAnswer("hand", "np.exp(-1 / (2 * work.sigma**2))", "np.exp(-1 / work.sigma**2)", "1/2"),
    WrongAnswer("hand", "np.exp(-1 / (2 * work.sigma**2))", "1", "plain mean"),
    WrongAnswer("filter", "total / weights", "total", "do not add up to 1"),
    WrongAnswer("filter", "total / weights", "(total / weights).detach()", "no gradient"),
    WrongAnswer(
        "filter",
        "(2 * sigma**2)",
        "(2 * sigma[(frames + d).clamp(0, len(x) - 1)] ** 2)",
        "OWN sigma",
    ),
    WrongAnswer(
        "filter",
        "w * neighbour\n        weights = weights + w",
        "w * neighbour\n        weights = weights + torch.exp(-(d**2) / (2 * sigma**2))",
        "Near the ends",
    ),
    WrongAnswer("filter", "(2 * sigma**2)", "(2 * sigma)", "sigma squared"),
    WrongAnswer("learn", "torch.exp(log_sigma).item()", "log_sigma.item()", "logarithm of sigma"),
    WrongAnswer("learn", "range(150)", "range(5)", "still too narrow"),
    WrongAnswer("learn", "loss.backward()", "(-loss).backward()", "uphill"),
    WrongAnswer("learn", ".item()", ".item() / 120", "in seconds"),
    WrongAnswer("network", "torch.exp(self.head(code))", "self.head(code) - 2", "below 0"),
    WrongAnswer("network", "batch_first=True, ", "", "clips of a batch mix"),
    WrongAnswer(
        "network",
        "torch.nn.LSTM(16, 12, batch_first=True, bidirectional=True)",
        "torch.nn.LSTM(16, 24, batch_first=True)",
        "looks back only",
    ),
    WrongAnswer("network", "np.log(4.0)", "4.0", "log(4)"),
    WrongAnswer(
        "network", "torch.nn.Linear(24, n_channels)", "torch.nn.Linear(24, 1)", "same shape"
    ),
    WrongAnswer("widths", "", "return constant_width(values)", "Not beaten"),
    WrongAnswer("widths", "", "return values.std(axis=0)", "as many widths"),
    WrongAnswer("widths", "", "return np.full(values.shape, 4 / 120)", "Not beaten"),
]

WRONG_ANSWERS_NETWORKS["gap_pipeline"] = [
    WrongAnswer(
        "steps",
        "int(np.ceil(round(work.gap_s * work.fps) / 4))",
        "round(work.gap_s * work.fps)",
        "These are frames",
    ),
    WrongAnswer("steps", "np.ceil(", "np.floor(", "round up"),
    WrongAnswer("steps", "round(work.gap_s * work.fps)", "work.gap_s", "another number"),
    WrongAnswer(
        "steps",
        "round(work.gap_s * work.fps) / 4",
        "round(work.gap_s * work.fps) * 4",
        "You multiplied",
    ),
    WrongAnswer("line", "", "return np.nan_to_num(values)", "0 degrees is an angle"),
    WrongAnswer(
        "line",
        "",
        "return np.where(np.isnan(values), np.nanmean(values), values)",
        "mean of the channel",
    ),
    WrongAnswer("line", "seen = ~np.isnan(values)", "seen = np.isnan(values)", "NaN"),
    WrongAnswer(
        "line",
        "",
        "values = np.array(values)\nfor t in range(1, len(values)):\n"
        "    if np.isnan(values[t]):\n        values[t] = values[t - 1]\nreturn values",
        "hold the last value",
    ),
    WrongAnswer("error", "[~mask]", "[mask]", "mask is inverted"),
    WrongAnswer("error", "[~mask]", "", "over all samples"),
    WrongAnswer(
        "error",
        "np.sqrt(np.mean((filled - clean)[~mask] ** 2))",
        "np.mean((filled - clean)[~mask] ** 2)",
        "mean square",
    ),
    WrongAnswer(
        "error",
        "np.sqrt(np.mean((filled - clean)[~mask] ** 2))",
        "np.abs((filled - clean)[~mask]).mean()",
        "absolute error",
    ),
    WrongAnswer("join", "prediction + shift", "prediction", "there is a step"),
    WrongAnswer("join", "prediction + shift", "prediction - shift", "subtract the shift"),
    WrongAnswer(
        "join",
        "np.where(seen, observed, prediction + shift)",
        "np.interp(frames, frames[seen], observed[seen])",
        "straight lines alone",
    ),
    WrongAnswer("join", "", "return prediction", "changed observed"),
    WrongAnswer(
        "interleave",
        "x.reshape(len(x), -1, stride, x.shape[-1])",
        "x.reshape(len(x), stride, -1, x.shape[-1]).transpose(1, 2)",
        "blocks of",
    ),
    WrongAnswer(
        "interleave",
        "x.transpose(1, 2).flatten(0, 1)",
        "x.permute(2, 0, 1, 3).flatten(0, 1)",
        "another order",
    ),
    WrongAnswer(
        "interleave",
        "x[:, -1:].expand(-1, missing, -1)",
        "0 * x[:, -1:].expand(-1, missing, -1)",
        "with zeros",
    ),
    WrongAnswer(
        "interleave",
        "x = torch.cat([x, x[:, -1:].expand(-1, missing, -1)], dim=1)",
        "x = x[:, : x.shape[1] // stride * stride]",
        "You dropped",
    ),
    WrongAnswer("fill", "return pca_gaps(observed)", "return lerp_gaps(observed)", "Not beaten"),
    WrongAnswer("fill", "return pca_gaps(observed)", "return observed", "still NaN"),
    WrongAnswer("fill", "pca_gaps(observed)", "pca_gaps(observed).channels", "Return a motion"),
    WrongAnswer(
        "fill",
        "",
        "from mocaplab.gap_fillers.curves import pchip_gaps\n\nreturn pchip_gaps(observed)",
        "half of the points",
        10.0,
    ),
]
