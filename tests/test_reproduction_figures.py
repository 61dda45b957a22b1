"""Figures and claims from results made by hand: no network is trained here."""

import csv
from dataclasses import replace

import matplotlib
import numpy as np
import pytest
from reproduction_cases import few_clips, made_up, small_plan

from mocaplab.comparison.bootstrap import Interval
from mocaplab.reproduction import (
    driver,
    figures_gaps,
    figures_noise,
    figures_over_time,
    figures_sources,
    figures_streaming,
)
from mocaplab.reproduction.claims import Claim, Evidence, number_text, of_motions, paragraph
from mocaplab.reproduction.figures import FIGURES
from mocaplab.reproduction.figures_detail import joint_speed
from mocaplab.reproduction.needs import make_groups
from mocaplab.reproduction.networks_inside import FilledGap
from mocaplab.reproduction.report import claims_to_markdown, file_name, write_figure, write_report
from mocaplab.reproduction.scores import Scores
from mocaplab.reproduction.verdicts import FAILS, HOLDS, NOT_ASKED, OPEN, WEAKER

matplotlib.use("agg")

PAPERS_ERRORS = {
    "gaussian_58": 2.25,
    "gaussian_125": 3.37,
    "ebd_denoiser": 3.57,
    "example_based": 3.67,
    "ebf": 1.46,
    "bf": 1.70,
    "nn": 1.92,
    "gaussian_tuned": 1.3,
}


def as_in_the_paper(method, number):
    """The paper's mean errors on a test of clips that are alike."""
    return PAPERS_ERRORS.get(method, 1.46) * (1 + 0.01 * number)


def evidence_of(
    dataset, figures, tmp_path, error=as_in_the_paper, epochs=200, full=0, subjects=None
):
    plan = small_plan(dataset, figures, epochs, full)
    groups = make_groups(dataset, subjects, plan)
    jobs = driver.jobs_of(plan, figures, dataset, subjects)
    results = {job: made_up(job, dataset, error) for job in jobs}
    (tmp_path / "rows").mkdir(exist_ok=True)
    return Evidence(plan, dataset, groups, Scores(results, plan), tmp_path)


@pytest.fixture(scope="module")
def many(embedded):
    """Sixty short clips: holdouts of ten, enough for a verdict."""
    chosen = [i for i, a in enumerate(embedded.actions) if a in ("walk", "jog")]
    dataset = embedded.select(chosen, "embedded")
    clips = tuple(clip.slice_frames(0, 96) for clip in dataset.clips)
    return replace(dataset, clips=clips)


def verdicts(evidence, name):
    return {claim.text: claim.verdict for claim in FIGURES[name].claims(evidence)}


def test_the_papers_own_numbers_hold(many, tmp_path):
    evidence = evidence_of(many, ("5", "8", "table-angular"), tmp_path)
    assert len(evidence.scores.by_clip("ebf")) >= 6
    assert set(verdicts(evidence, "8").values()) == {HOLDS}
    table = verdicts(evidence, "table-angular")
    assert table["EBF, against Gaussian 58 ms"] == HOLDS
    assert table["EBF, against Gaussian tuned"] == NOT_ASKED
    assert table["EBF leaves 1.46 degrees"] == OPEN  # other clips: degrees cannot be compared
    fifth = FIGURES["5"].claims(evidence)
    assert fifth[0].verdict == HOLDS
    assert fifth[1].ours.value == 0  # it loses on every motion, and that is said
    assert "Gaussian tuned" in fifth[1].why


def test_smaller_effects_are_weaker_and_none_fails(many, tmp_path):
    errors = {"bf": 1.5, "nn": 1.46}
    weaker = evidence_of(
        many, ("8",), tmp_path, lambda method, n: errors.get(method, 1.46) * (1 + 0.01 * n)
    )
    found = list(verdicts(weaker, "8").values())
    assert found == [WEAKER, FAILS]


def test_barely_trained_networks_prove_nothing(many, tmp_path):
    claims = FIGURES["8"].claims(evidence_of(many, ("8",), tmp_path, epochs=5))
    assert {claim.verdict for claim in claims} == {OPEN}
    assert claims[0].why == "networks were trained for 5 of 200 epochs"


def test_few_clips_prove_nothing(embedded, tmp_path):
    claims = FIGURES["8"].claims(evidence_of(few_clips(embedded), ("8",), tmp_path))
    assert {claim.verdict for claim in claims} == {OPEN}
    assert "clips are too few" in claims[0].why


def test_given_networks_speak_though_others_are_barely_trained(many, tmp_path):
    evidence = evidence_of(many, ("5", "8"), tmp_path, epochs=5, full=1)
    first = FIGURES["5"].claims(evidence)[0]
    assert first.verdict == OPEN  # EBD, among the rivals, is barely trained
    wiener = FIGURES["5"].claims(evidence)[2]
    assert wiener.why == "lost on 10 of 10: 10 to Wiener"  # a draw is no win
    assert evidence.scores.by_clip("ebf+") == evidence.scores.by_clip("ebf")


def test_amounts_that_train_alike(many, tmp_path):
    alike = evidence_of(many, ("6",), tmp_path)
    assert FIGURES["6"].claims(alike)[0].verdict == HOLDS
    apart = evidence_of(
        many,
        ("6",),
        tmp_path,
        lambda method, n: (2.0 if method == "ebf@angular:0.9" else 1.0) * (1 + 0.01 * n),
    )
    claim = FIGURES["6"].claims(apart)[0]
    assert claim.verdict == FAILS
    assert "trained on angular:0.9" in claim.text
    assert claim.ours.value == pytest.approx(2)


def test_an_action_never_seen(many, tmp_path):
    evidence = evidence_of(many, ("actions",), tmp_path)
    against, cost, _ = FIGURES["actions"].claims(evidence)
    assert against.verdict == HOLDS  # 1.46 / 2.25 is even better than the paper's 1.76 / 2.25
    assert cost.verdict == FAILS  # both have the same error here: it costs nothing
    assert cost.ours.value == pytest.approx(1)


def test_speed_is_that_of_the_joints(embedded):
    clip = embedded.clips[0].slice_frames(0, 50)
    ramp = np.where(clip.channels.std(axis=0) > 1e-3, 1.0, 0.0)
    moving = clip.with_channels(np.arange(50)[:, None] * ramp * clip.frame_time * 30)
    np.testing.assert_allclose(joint_speed(moving), 30, rtol=1e-9)


@pytest.fixture
def without_networks(monkeypatch):
    """Stand-ins for all that would need a trained network."""
    kernel = np.exp(-0.5 * (np.arange(-15, 16) / 3.0) ** 2)
    kernels = np.tile(kernel / kernel.sum(), (60, 1))
    monkeypatch.setattr(figures_over_time, "kernels_of", lambda model, clip: kernels)
    monkeypatch.setattr(figures_noise, "bias_share", lambda model, clips: 0.01)

    def fill(dataset, jobs, index, models):
        flat = np.zeros(96)
        return FilledGap(dataset.clips[index].name, "knee", (20, 60), flat, {"ebf": flat + 1})

    monkeypatch.setattr(figures_gaps, "fill_one_gap", fill)

    def stream(evidence):
        return [
            {"method": method, "look_ahead_frames": n, "clip": f"c{i}", "rms_all_deg": 1 + 0.01 * i}
            | {"ms_per_frame": 0.5 + 0.01 * i, "whole_deg": 1 + 0.01 * i, "look_ahead_ms": 8.0 * n}
            for method in ("EBF", figures_streaming.GAUSSIAN)
            for n in figures_streaming.FRAMES
            for i in range(6)
        ]

    def sources(dataset, split, plan, models):
        return [
            {"clip": f"c{i}", "action": "walk", "repetition": 0, "input A": 2.0, "input B": 2.0}
            | {"mean": 1.0, "gated Gaussian mean": 0.5, "network": 0.8}
            for i in range(6)
        ]

    monkeypatch.setattr(figures_streaming, "_stream", stream)
    monkeypatch.setattr(figures_sources, "source_rows", sources)


def test_people_never_seen_need_to_know_who_moves(many, tmp_path):
    assert FIGURES["subjects"].draw(evidence_of(many, ("subjects",), tmp_path)) is None


def test_methods_are_drawn_on_the_clips_that_all_have(many, tmp_path):
    figures = ("5", "8", "actions")
    evidence = evidence_of(many, figures, tmp_path, epochs=20, full=3)
    assert len(evidence.scores.by_clip("gaussian_tuned")) == 30  # as many as the given networks
    assert len(evidence.scores.by_clip("nn")) == 10
    rows, _ = FIGURES["8"].draw(evidence)
    assert len(rows) == 4 * 10
    assert not np.isnan([row["rms_all_deg"] for row in rows]).any()
    rows, _ = FIGURES["5"].draw(evidence)
    assert len({row["clip"] for row in rows}) == 30


def test_every_figure_is_drawn_and_written(many, tmp_path, without_networks):
    subjects = [i % 12 for i in range(len(many))]
    evidence = evidence_of(many, tuple(FIGURES), tmp_path, subjects=subjects)
    claims, parts = [], []
    for figure in FIGURES.values():
        rows, picture = figure.draw(evidence)
        assert rows
        assert picture.axes
        judged = figure.claims(evidence)
        assert all(claim.figure in FIGURES for claim in judged)
        claims += judged
        parts.append(write_figure(figure, rows, picture, judged, evidence.plan, tmp_path))
        with open(tmp_path / f"{file_name(figure.name)}.csv", newline="") as file:
            assert next(file).startswith("# budget 1 min: ")
            assert len(list(csv.DictReader(file))) == len(rows)
        assert (tmp_path / f"{file_name(figure.name)}.png").stat().st_size > 5000
    write_report(claims, parts, evidence.plan, tmp_path)
    report = (tmp_path / "report.md").read_text()
    assert "embedded clips, made up by a model" in report
    assert all(f"## {figure.title}" in report for figure in FIGURES.values())
    page = (tmp_path / "report.html").read_text()
    assert all(f"<h2>{figure.title}</h2>" in page for figure in FIGURES.values())
    assert page.count("data:image/png;base64,") == report.count("](")
    assert page.count("<tr>") == len(claims) + 1
    found = {claim.text: claim.verdict for claim in claims}
    assert found["free kernels look Gaussian"] == HOLDS
    assert found["the bias term vanishes without bias"] == HOLDS
    assert found["the network is nearer to the truth than both of its inputs"] == HOLDS
    timed = "EBF cleans in real time, whole clips on one core (median, fastest and slowest clip)"
    assert found[timed] == HOLDS
    assert "EBF works in a stream, as well as on whole clips (15 frames of look-ahead)" in found


def test_names_of_actions_stand_above_the_frame_of_the_axes(many, tmp_path):
    _, picture = FIGURES["8"].draw(evidence_of(many, ("8",), tmp_path))
    picture.draw_without_rendering()
    (ax,) = picture.axes
    names = {text.get_text(): text.get_window_extent() for text in ax.texts}
    assert set(names) == {"walk", "jog"}
    assert min(place.y0 for place in names.values()) > ax.get_window_extent().y1


def test_figure_5_has_a_log_axis_and_says_so(many, tmp_path):
    evidence = evidence_of(many, ("5", "8"), tmp_path)
    (fifth,), (eighth,) = (FIGURES[name].draw(evidence)[1].axes for name in ("5", "8"))
    assert fifth.get_yscale() == "log"
    assert "log scale" in fifth.get_ylabel()
    assert eighth.get_yscale() == "linear"
    assert "log" not in eighth.get_ylabel()


def test_what_was_made_before_is_read_again(many, tmp_path):
    evidence = evidence_of(many, ("8",), tmp_path)
    assert evidence.cached("numbers", lambda: [{"a": 1.5}]) == [{"a": 1.5}]
    assert evidence.cached("numbers", lambda: [{"a": 2.5}]) == [{"a": 1.5}]


def claim(verdict, value=0.5, paper="0.60 times", why=""):
    ours = Interval(value, value - 0.1, value + 0.1)
    return Claim("8", "a claim", paper, ours, "times", 10, verdict, why)


def test_paragraphs_come_from_the_claims():
    text = paragraph([claim(FAILS, why="no effect"), claim(HOLDS), claim(NOT_ASKED, paper="-")])
    assert text == (
        "What agrees: a claim (paper: 0.60 times; ours: 0.50 (0.40 to 0.60) times). "
        "What does not agree: a claim (paper: 0.60 times; ours: 0.50 (0.40 to 0.60) times; "
        "no effect). "
        "What the paper did not try: a claim (ours: 0.50 (0.40 to 0.60) times)."
    )
    assert paragraph([]) == "Nothing is claimed here."


def test_a_number_without_an_interval_stands_alone():
    assert number_text(Interval(0.88, 0.76, 1.009), "times", 10) == "0.88 (0.76 to 1.01) times"
    assert number_text(Interval(7, 7, 7), of_motions(10), 10) == "7 of 10 motions"
    assert number_text(Interval(0, 0, 0), of_motions(1), 1) == "0 of 1 motions"
    # A bootstrap of one clip rounds: its ends are equal but for the last digit.
    one_clip = Interval(0.7, 0.7 - 1e-16, 0.7 + 1e-16)
    assert number_text(one_clip, "times", 1) == "0.70 times (one clip: no interval)"
    assert number_text(Interval(0.0123, 0.0042, 0.05), "", 3) == "0.012 (0.0042 to 0.05)"
    assert number_text(Interval(np.nan, np.nan, np.nan), "times", 0) == "-"


def test_one_clip_has_no_interval_in_the_claim_table(many, tmp_path):
    one = many.select([0, 1, 2], "embedded")
    evidence = evidence_of(one, ("8",), tmp_path)
    claims = FIGURES["8"].claims(evidence)
    assert claims[0].clips == 1
    assert claims[0].number() == "1.16 times (one clip: no interval)"


def test_the_claim_table_has_the_papers_claims_first():
    lines = claims_to_markdown([claim(NOT_ASKED), claim(HOLDS)]).splitlines()
    assert "**holds**" in lines[2]
    assert "**not in the paper**" in lines[3]
    nothing = Claim("9", "x", "-", Interval(np.nan, np.nan, np.nan), "", 0, OPEN, "no network")
    assert "| 9 | x | - | - | **cannot be tested here** | no network |" in claims_to_markdown(
        [nothing]
    )
