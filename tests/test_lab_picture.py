"""The still picture of the lab shows the same numbers as the lab."""

from __future__ import annotations

import base64
import re
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

from mocaplab.lab.gaussian import WIDTHS_S
from mocaplab.lab.model import Laboratory, LabSettings
from mocaplab.lab.picture import draw_lab, joint_widths, still_html

KNEE = "LeftLeg.Xrotation"


@pytest.fixture(scope="module")
def scene(embedded):
    some = embedded.select([0, 70], "few")
    few = replace(some, clips=tuple(clip.slice_frames(0, 60) for clip in some.clips))
    return Laboratory(few).scene(LabSettings(few.clips[0].name))


def test_the_picture_holds_curves_errors_and_widths(scene):
    figure = draw_lab(scene, KNEE, float(WIDTHS_S[10]), 0.0)
    curves, widths, bars, heat, _ = figure.axes
    labels = [line.get_label() for line in curves.lines]
    assert labels == ["observed", "Gaussian", "EBF", "Blend", "clean"]
    np.testing.assert_array_equal(curves.lines[-1].get_ydata(), scene.corrupted.clean.channel(KNEE))
    np.testing.assert_array_equal(widths.lines[0].get_ydata(), scene.gaussian_rms[0])
    errors = list(scene.errors_deg(float(WIDTHS_S[10]), 0.0).values())
    np.testing.assert_allclose([patch.get_width() for patch in bars.patches], errors)
    assert heat.images[0].get_array().shape == (len(joint_widths(scene)[0]), 60)
    assert plt.get_fignums() == []


def test_widths_are_averaged_over_the_channels_of_a_joint(scene):
    joints, widths = joint_widths(scene)
    labels = scene.filled.skeleton.channel_labels
    hand = [c for c in scene.channels if labels[c].startswith("LeftHand.")]
    right = scene.sigma_s[:, hand].mean(axis=1)
    np.testing.assert_allclose(widths[:, joints.index("LeftHand")], right)
    assert "Hips" not in joints


def test_the_page_has_a_picture_with_words_beside_it(scene):
    text = still_html(scene, KNEE, 0.03)
    assert base64.b64decode(re.search(r'base64,([^"]*)"', text)[1]).startswith(b"\x89PNG")
    assert 'alt="Four pictures.' in text
