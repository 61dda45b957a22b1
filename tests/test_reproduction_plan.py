"""Plans: the ladder of budgets, what is computed on each step, and the plan that is kept."""

from dataclasses import replace
from itertools import pairwise

import pytest
from reproduction_cases import few_clips, small_plan

from mocaplab.noise.draws import draw_training
from mocaplab.reproduction import driver
from mocaplab.reproduction.costs import estimate_s, sources_s, training_s
from mocaplab.reproduction.figures import FIGURES, list_figures, read_names
from mocaplab.reproduction.needs import NOISE, Need, make_groups, make_jobs, measures_of
from mocaplab.reproduction.plan import (
    LADDER,
    at_level,
    check_same,
    load_plan,
    most_holdouts,
    save_plan,
)
from mocaplab.splits import Split

STEPS = {"ebf": 0.5, "nn": 0.2, "blend": 0.6, "ebd_denoiser": 0.2}


@pytest.fixture(scope="module")
def few(embedded):
    return few_clips(embedded)


@pytest.fixture(autouse=True)
def steps(monkeypatch):
    """Training steps that take the same on every machine."""
    monkeypatch.setattr(driver, "measure_steps", lambda dataset, networks: STEPS)


def plan_for(dataset, budget_min, figures=("8",), **options):
    values = {"seed": 0, "workers": 2, **options}
    return driver.make_plan(figures, dataset, None, budget_min=budget_min, **values)


def test_a_larger_budget_never_gets_less(embedded):
    levels = [plan_for(embedded, minutes) for minutes in (2, 10, 60, 600, 60_000)]
    for smaller, larger in pairwise(levels):
        assert smaller.epochs <= larger.epochs
        assert smaller.holdouts <= larger.holdouts
        assert smaller.repetitions <= larger.repetitions
    assert (levels[-1].holdouts, levels[-1].epochs, levels[-1].width) == (5, 200, 1000)
    assert levels[-1].train_clips is None


def test_more_figures_leave_less_for_each(embedded):
    assert plan_for(embedded, 60, tuple(FIGURES)).epochs < plan_for(embedded, 60).epochs


def test_too_small_a_budget_says_which_works(few):
    with pytest.raises(ValueError, match=r"a budget of 0\.01 minutes is too small .* --budget 1$"):
        plan_for(few, 0.01)
    assert plan_for(few, 1).epochs >= 1


def test_paper_a_at_full_size_takes_days(embedded):
    plan = at_level(plan_for(embedded, 60, tuple(FIGURES)), LADDER[-1])
    seconds = estimate_s(
        driver.jobs_of(plan, plan.figures, embedded, None), embedded, plan, STEPS, workers=2
    )
    assert seconds + sources_s(LADDER[-1], STEPS) > 86400


def test_training_is_priced_by_its_steps():
    # 19200 counted frames are 10 steps of 16 pieces with 120 counted frames each.
    once = training_s("ebf", None, 19_200, 1, STEPS)
    assert training_s("ebf", None, 19_200, 11, STEPS) - once == pytest.approx(10 * 10 * 0.5)
    assert training_s("bf", None, 19_200, 1, STEPS) == once
    assert training_s("ebf", "spatial:0.5", 19_200, 1, STEPS) > once


def test_plans_are_kept_and_only_continued_by_the_same_request(few, tmp_path):
    path = tmp_path / "plan.json"
    assert load_plan(path) is None
    plan = small_plan(few, ("5", "8"))
    save_plan(plan, path)
    stored = load_plan(path)
    assert stored == plan
    check_same(stored, replace(plan, figures=("8",)), path)  # fewer figures are welcome
    for change, message in (
        ({"budget_min": 2.0}, r"budget_min \(1.0, now 2.0\)"),
        ({"seed": 1}, r"seed \(0, now 1\)"),
        ({"digest": "x"}, "digest"),
        ({"figures": ("5", "3")}, r"figures \(5, 8; now also 3\)"),
        ({"full": 2}, r"holdouts with given networks \(0, now 2\)"),
    ):
        with pytest.raises(ValueError, match=f"has another plan: {message}"):
            check_same(stored, replace(plan, **change), path)
    path.write_text('{"budget": 3}')
    with pytest.raises(ValueError, match="expected the plan of a reproduction"):
        load_plan(path)


def test_labels_say_what_a_figure_was_made_with(few):
    plan = small_plan(few, ("8",))
    assert plan.label().startswith("budget 1 min: 1 of 5 holdouts, 1 of 5 draws of noise, 1 of 200")
    assert plan.label().endswith("embedded clips, made up by a model")
    assert replace(plan, data="cmu").label().endswith("clips of cmu")


def test_splits_are_those_of_evaluate(embedded):
    from mocaplab.splits import make_splits

    plan = at_level(driver.wanted_plan(("5",), embedded, 1, 0, 0), LADDER[7])
    groups = make_groups(embedded, None, plan)
    same = make_splits("paper", embedded.actions, seed=0)
    assert groups["holdout"] == {name: same[name] for name in ("holdout_1", "holdout_2")}
    assert set(groups["without"]) == {"without_" + a for a in set(embedded.actions)}
    tested = {i for split in groups["holdout"].values() for i in split.test}
    for action, split in groups["without"].items():
        assert set(split.test) <= tested
        assert all(f"without_{embedded.actions[i]}" != action for i in split.train)
    assert not groups["subjects"]  # nobody knows who moves
    first = groups["holdout"]["holdout_1"]
    assert len(groups["quarter"]["quarter_1"].train) == len(first.train) // 4
    assert groups["quarter"]["quarter_1"].test == first.test


def test_fewer_clips_still_show_all_actions(embedded):
    plan = at_level(driver.wanted_plan(("5",), embedded, 1, 0, 0), LADDER[1])
    split = make_groups(embedded, None, plan)["holdout"]["holdout_1"]
    assert (len(split.train), len(split.test)) == (8, 4)
    assert len({embedded.actions[i] for i in split.train}) == 5


def test_people_who_move_are_kept_apart(few):
    plan = small_plan(few, ("subjects",))
    split = make_groups(few, [1, 2, 3, 1, 2, 3], plan)["subjects"]["subjects_1"]
    assert {i % 3 for i in split.train}.isdisjoint({i % 3 for i in split.test})


def test_every_job_is_there_once_and_networks_share_their_files(few):
    plan = small_plan(few, tuple(FIGURES))
    jobs = driver.jobs_of(plan, plan.figures, few, None)
    assert len({job.name for job in jobs}) == len(jobs)
    ebf = [job for job in jobs if job.method == "ebf" and job.holdout == "holdout_1"]
    assert len({job.network_name for job in ebf}) == 1
    assert len(ebf) > 5
    assert any(job.detail for job in ebf)


def test_given_networks_stand_in_the_headlines_alone(embedded):
    plan = at_level(driver.wanted_plan(("5", "8"), embedded, 1, 0, 3), LADDER[2])
    jobs = driver.jobs_of(plan, plan.figures, embedded, None)
    epochs = {(job.method, job.holdout): job.epochs for job in jobs if job.method == "bf"}
    assert epochs == {("bf", "holdout_1"): 5}
    ebf = sorted((job.holdout, job.epochs or 0) for job in jobs if job.method == "ebf")
    assert ebf == [("holdout_1", 0), ("holdout_1", 5), ("holdout_2", 0), ("holdout_3", 0)]
    whole = [job for job in jobs if job.method == "wiener"]
    assert [len(job.split.train) for job in whole] == [90, 90, 90]  # fitted on as much as they
    assert len(next(job for job in jobs if job.method == "bf").split.train) == 16


def test_what_is_measured_depends_on_the_noise():
    assert measures_of(NOISE) == ("rms_all_deg", "rms_moving_deg")
    assert measures_of("angular:0.5+long_gaps:2")[-1] == "gap_rms_deg"
    assert measures_of("angular:0")[-1] == "harm_deg"


def test_long_gaps_are_tested_only_where_they_fit(few):
    jobs = driver.jobs_of(small_plan(few, ("10",)), ("10",), few, None)
    assert {job.corruption for job in jobs} == {"angular:0.5+long_gaps:0.5"}


def test_what_is_fitted_to_long_gaps_learns_from_clips_that_they_fit(embedded):
    recipe = "angular:0.5+long_gaps:2"
    split = Split(tuple(range(50, 100)), tuple(range(50)))
    need = Need(("gap_pca", "ebf"), (recipe,))
    plan = small_plan(embedded, ("10",))
    pca, ebf = make_jobs([need], embedded, {"holdout": {"holdout_1": split}}, plan)
    assert {embedded.clips[i].duration_s > 2.25 for i in pca.split.train + pca.split.test} == {True}
    assert len(pca.split.train) < len(split.train)  # or this would show nothing
    assert ebf.split.train == split.train  # it learns from pieces of another recipe
    for index in pca.split.train:
        draw_training(embedded.clips[index], recipe, seed=0)


def test_most_holdouts(few, embedded):
    assert most_holdouts(embedded, 0) == 5
    assert most_holdouts(few, 0) == 3
    with pytest.raises(ValueError, match="holdouts need at least"):
        most_holdouts(few.select([0], "one"), 0)


def test_names_of_figures():
    assert read_names(["all"]) == tuple(FIGURES)
    assert read_names(["8", "3"]) == ("3", "8")
    with pytest.raises(ValueError, match=r"no figure 'timming'; the nearest names are timing"):
        read_names(["3", "timming"])
    listed = list_figures()
    for figure in FIGURES.values():
        assert figure.title in listed
        assert figure.asks in listed
