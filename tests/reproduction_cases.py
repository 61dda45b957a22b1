"""What the tests of the reproduction share: few short clips, and results made by hand."""

from mocaplab.datasets import Dataset
from mocaplab.reproduction import driver
from mocaplab.reproduction.plan import Level, at_level

NAMES = ("walk_01", "walk_02", "walk_03", "jog_01", "jog_02", "jog_03")


def few_clips(embedded, frames=96):
    """Six clips of two actions; 96 frames are room for a gap of half a second."""
    clips = tuple(embedded[name].slice_frames(0, frames) for name in NAMES)
    return Dataset("embedded", clips, ("walk",) * 3 + ("jog",) * 3)


def small_plan(dataset, figures, epochs=1, full=0):
    plan = driver.wanted_plan(figures, dataset, 1.0, 0, full)
    return at_level(plan, Level(None, None, 1, 1, epochs, 8))


def made_up(job, dataset, error):
    """A result whose errors are what ``error`` returns for a method and a clip's number."""
    rows = []
    for i in job.split.test:
        clip = dataset.clips[i]
        value = error(job.method, i)
        row = {"clip": clip.name, "action": dataset.actions[i], "repetition": 0}
        row |= {"frames": clip.n_frames, "seconds": 0.01}
        row |= dict.fromkeys(job.measures, value)
        if job.detail:
            row["by_frame_deg"] = [value] * clip.n_frames
            row["by_joint_deg"] = [value] * clip.skeleton.n_joints
        rows.append(row)
    return {"rows": rows, "notes": [], "fit_s": 0.0}
