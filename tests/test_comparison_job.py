"""Jobs of a comparison: the same noise for all, rows that are only read where they fit."""

import json
from dataclasses import replace

import numpy as np
import pytest

from mocaplab.comparison.job import ORACLE, Job, make_jobs, spell_recipe, usable_measures
from mocaplab.comparison.methods import METHODS, Method
from mocaplab.comparison.result import fingerprint, load_result, save_result
from mocaplab.comparison.run_job import fit_method, run_job
from mocaplab.corruption import corrupt
from mocaplab.datasets import Dataset, clip_digest
from mocaplab.filters import GaussianDenoiser
from mocaplab.measures.by_name import MEASURES, rms_all_deg
from mocaplab.motion import Corrupted
from mocaplab.noise import draws
from mocaplab.noise.draws import draw_seed, draw_test, draw_training
from mocaplab.splits import Split
from mocaplab.tuning import oracle_gaussian, tune_gaussian

RMS = ("rms_all_deg", "rms_moving_deg")


@pytest.fixture(scope="module")
def few(embedded):
    clips = [clip.slice_frames(0, 80) for clip in embedded.clips[:6]]
    return Dataset("few", tuple(clips), ("walk", "walk", "run", "walk", "run", "walk"))


@pytest.fixture
def job():
    split = Split((2, 3, 4, 5), (0, 1))
    return Job("holdout_1", split, "angular:0.5", "gaussian_tuned", RMS, 0, 2)


def test_a_job_scores_what_its_parts_give(few, job):
    """Put together by hand: the noise, the tuned width, the filter and the measure."""

    def drawn(i, name, repetition):
        seed = draw_seed(0, clip_digest(few.clips[i]), name, repetition)
        return corrupt(few.clips[i], "angular:0.5", rng=np.random.default_rng(seed))

    sigma_s, _ = tune_gaussian([drawn(i, "training/angular:0.5", 0) for i in (2, 3, 4, 5)])
    rows = run_job(few, job)["rows"]
    assert [(row["clip"], row["repetition"]) for row in rows] == [
        (few.clips[i].name, repetition) for i in (0, 1) for repetition in (0, 1)
    ]
    for row, i in zip(rows, (0, 0, 1, 1), strict=True):
        clip = drawn(i, "angular:0.5", row["repetition"])
        cleaned = GaussianDenoiser(sigma_s).denoise(clip.observed, clip.mask)
        assert row["rms_all_deg"] == rms_all_deg(cleaned, clip.clean)
        assert row["action"] == "walk"
        assert row["frames"] == 80
        assert row["seconds"] > 0


def test_oracle_is_no_worse_than_any_gaussian(few, job):
    oracle = run_job(few, replace(job, method=ORACLE))["rows"]
    for row, other in zip(oracle, run_job(few, job)["rows"], strict=True):
        assert row["rms_all_deg"] <= other["rms_all_deg"]
    clip = draw_test(few.clips[0], "angular:0.5", seed=0, repetition=0)
    assert oracle[0]["rms_all_deg"] == rms_all_deg(oracle_gaussian(clip), clip.clean)


def test_noise_depends_on_clip_seed_recipe_and_repetition_alone(few):
    def noise(i, recipe="angular:0.5", seed=0, repetition=0):
        return draw_test(few.clips[i], recipe, seed=seed, repetition=repetition).observed.channels

    first = noise(0)
    draws._KEPT.clear()
    noise(1), noise(0, repetition=1)
    np.testing.assert_array_equal(noise(0), first)
    for other in (noise(0, "angular:0.4"), noise(0, seed=1), noise(0, repetition=1)):
        assert (other != first).any()
    training = draw_training(few.clips[0], "angular:0.5", seed=0).observed.channels
    assert (training != first).any()


def test_the_same_angles_on_longer_bones_are_another_clip(few):
    clip = few.clips[0]
    taller = replace(clip, skeleton=replace(clip.skeleton, offsets=2 * clip.skeleton.offsets))
    for motion in (clip, taller):
        drawn = draw_test(motion, "angular:0.5", seed=0, repetition=0)
        assert drawn.clean.skeleton is motion.skeleton


@pytest.mark.parametrize("method", sorted(METHODS))
def test_other_clips_of_the_holdout_do_not_change_the_score_of_one(few, job, method):
    """Were anything fitted to the test clips, another holdout would change it."""
    split = Split((2, 3), (0, 1))
    other = replace(few.clips[4], name="other")
    swapped = replace(few, clips=(few.clips[0], other, *few.clips[2:]))
    alone = replace(job, method=method, split=split, corruption="angular:0.5+gaps:0.001")
    alone = replace(alone, repetitions=1)
    rows = [run_job(dataset, alone)["rows"] for dataset in (few, swapped)]
    assert [row["clip"] for row in rows[1]] == [few.clips[0].name, "other"]
    for measure in RMS:
        assert rows[0][0][measure] == rows[1][0][measure]
        assert rows[0][1][measure] != rows[1][1][measure]


def test_what_is_kept_is_bounded(few, monkeypatch):
    draws._KEPT.clear()
    monkeypatch.setattr(draws, "_KEPT_SAMPLES", 2 * few.clips[0].channels.size)
    for repetition in range(9):
        draw_test(few.clips[0], "angular:0.5", seed=0, repetition=repetition)
        assert len(draws._KEPT) <= 3
    draws._KEPT.clear()


def test_jobs_of_one_corruption_stand_together(job):
    splits = {"a": job.split, "b": job.split}
    jobs = make_jobs(splits, ["x:1", "y:2"], ["m", "n"], RMS, seed=3, repetitions=4)
    assert [(j.corruption, j.holdout, j.method) for j in jobs] == [
        (c, h, m) for c in ("x:1", "y:2") for h in "ab" for m in "mn"
    ]
    assert len({j.name for j in jobs}) == 8
    assert {(j.seed, j.repetitions, j.measures) for j in jobs} == {(3, 4, RMS)}


def test_a_jobs_name_can_be_a_files(job):
    name = replace(job, corruption="angular:0.5+gaps:0.001").name
    assert name == "angular_0.5+gaps_0.001-gaussian_tuned-holdout_1"


def test_a_large_amount_is_spelled_so_that_it_can_be_read():
    for recipe in ("angular:1e7", "angular:1e+7", "angular:10000000+gaps"):
        spelled = spell_recipe(recipe)
        assert spelled.split("+")[0] == "angular:1e07"
        assert spell_recipe(spelled) == spelled


@pytest.mark.parametrize("recipe", ["0.5", "angular", "angular:0.50"])
def test_recipes_have_one_spelling(recipe):
    assert spell_recipe(recipe) == "angular:0.5"
    assert spell_recipe(f"{recipe} + gaps:1e-3") == "angular:0.5+gaps:0.001"


def test_measures_that_a_skeleton_does_not_allow_are_named(few, small_motion):
    names, refused = usable_measures(few.clips[0])
    assert set(names) == set(MEASURES)
    assert not refused
    longer = replace(small_motion.skeleton, offsets=small_motion.skeleton.offsets * 1e4)
    names, refused = usable_measures(replace(small_motion, skeleton=longer))
    assert "rms_all_deg" in names
    assert "expected a leg" in refused["mpjpe_cm"]


class _Holes:
    def denoise(self, observed, mask):
        channels = observed.channels.copy()
        channels[3:5, 7] = np.nan
        return observed.with_channels(channels)


def test_a_method_that_leaves_gaps_is_refused(few, job, monkeypatch):
    monkeypatch.setitem(METHODS, "gaussian_tuned", Method("x", "x", lambda clips: _Holes()))
    label = few.skeleton.channel_labels[7].replace(".", r"\.")
    with pytest.raises(
        ValueError, match=f"left 2 samples .* empty, the first in {label} in frame 3"
    ):
        run_job(few, job)


def test_a_network_is_trained_once_for_all_corruptions(few, job, tmp_path):
    job = replace(job, method="bf", epochs=1)
    first = run_job(few, job, tmp_path)
    (model,) = tmp_path.iterdir()  # and no state is left
    written = model.stat().st_mtime_ns
    for other in (job, replace(job, corruption="angular:0.1")):
        again = run_job(few, other, tmp_path)
        assert model.stat().st_mtime_ns == written
    without_disk = run_job(few, job, tmp_path / "not there")  # another machine
    for row, same in zip(first["rows"], without_disk["rows"], strict=True):
        assert row["rms_all_deg"] == same["rms_all_deg"]
    assert again["rows"][0]["rms_all_deg"] != first["rows"][0]["rms_all_deg"]
    with pytest.raises(ValueError, match="was trained with other clips; take it away"):
        run_job(few, replace(job, split=Split((2, 3, 4), (0, 1))), tmp_path)
    assert replace(job, epochs=2).network_name == "bf-holdout_1-2"  # a file of its own
    assert replace(job, epochs=None).network_name == "bf-holdout_1"
    assert replace(job, method="noisy").network_name == "noisy-holdout_1"


def test_a_network_may_be_trained_on_one_recipe(few, job, tmp_path):
    job = replace(job, method="bf@uniform:0.5", epochs=1)
    run_job(few, job, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["bf_uniform_0.5-holdout_1-1.safetensors"]
    assert fingerprint(few, job)["epochs"] == 1


def test_a_pipeline_fills_with_one_network_and_cleans_with_the_other(few, job, tmp_path):
    job = replace(job, method="ebd_ebf", epochs=1, corruption="angular:0.1+gaps:0.01")
    clean = fit_method(few, job, tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"ebd-holdout_1-1.safetensors", "ebf-holdout_1-1.safetensors"}
    clip = draw_test(few.clips[0], job.corruption, seed=0, repetition=0)
    filled = fit_method(few, replace(job, method="ebd"), tmp_path)(clip)
    whole = Corrupted(clip.clean, filled, np.ones_like(clip.mask))
    by_hand = fit_method(few, replace(job, method="ebf"), tmp_path)(whole)
    np.testing.assert_array_equal(clean(clip).channels, by_hand.channels)
    assert fingerprint(few, job)["epochs"] == 1


def test_detail_parts_the_error_by_frame_and_joint(few, job):
    (row, *_) = run_job(few, replace(job, detail=True))["rows"]
    clip = few.clips[0]
    mean_square = np.mean(np.square(row["by_frame_deg"]))
    assert np.sqrt(mean_square) == pytest.approx(row["rms_all_deg"], abs=1e-3)
    weights = np.bincount(clip.skeleton.channel_joint[clip.skeleton.is_cleaned], minlength=31)
    by_joint = np.average(np.square(row["by_joint_deg"]), weights=weights)
    assert np.sqrt(by_joint) == pytest.approx(row["rms_all_deg"])
    assert row["by_joint_deg"][0] == 0  # the root


def test_rows_are_read_back_as_they_were(few, job, tmp_path):
    path = tmp_path / "rows.json"
    assert load_result(path, fingerprint(few, job)) is None
    result = run_job(few, job)
    result["rows"][0]["rms_all_deg"] = np.nan
    save_result(path, result)
    back = load_result(path, fingerprint(few, job))
    np.testing.assert_equal(back, result)


def test_rows_of_other_settings_are_refused(few, job, tmp_path):
    path = tmp_path / "rows.json"
    save_result(path, run_job(few, job))
    with pytest.raises(ValueError, match=r"other settings: seed \(0, now 1\); choose another"):
        load_result(path, fingerprint(few, replace(job, seed=1)))
    clips = (few.clips[0].slice_frames(1, 80), *few.clips[1:])
    with pytest.raises(ValueError, match="other settings: test clips"):
        load_result(path, fingerprint(replace(few, clips=clips), job))
    actions = (*few.actions[:5], "jump")
    with pytest.raises(ValueError, match="other settings: training clips"):
        load_result(path, fingerprint(replace(few, actions=actions), job))
    slower = tuple(replace(clip, frame_time=1 / 60) for clip in few.clips)
    with pytest.raises(ValueError, match=r"training clips .* test clips"):
        load_result(path, fingerprint(replace(few, clips=slower), job))


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "{}", '{"fingerprint": {}}', '{"fingerprint": 3, "rows": []}']
)
def test_files_that_are_no_rows_are_refused(few, job, tmp_path, text):
    (tmp_path / "rows.json").write_text(text)
    with pytest.raises(ValueError, match=r"rows\.json: expected the rows of a comparison"):
        load_result(tmp_path / "rows.json", fingerprint(few, job))


def test_rows_without_their_measures_are_refused(few, job, tmp_path):
    result = run_job(few, job)
    del result["rows"][1]["rms_all_deg"]
    (tmp_path / "rows.json").write_text(json.dumps(result))
    with pytest.raises(ValueError, match="rows lack measures"):
        load_result(tmp_path / "rows.json", fingerprint(few, job))
