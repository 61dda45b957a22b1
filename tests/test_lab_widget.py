"""The lab, driven as the browser drives it; no browser takes part."""

from __future__ import annotations

import asyncio
import base64
import json
import re
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

pytest.importorskip("anywidget", reason="the lab needs pip install 'mocaplab[lab]'")
import traitlets
from unpack import unpack_steps

from mocaplab.lab.data import SCALE
from mocaplab.lab.gaussian import LOOK_AHEADS_S, WIDTHS_S
from mocaplab.lab.model import MAX_GAP_S, NOISES, max_amount
from mocaplab.lab.widget import Lab

KNEE = "LeftLeg.Xrotation"
WIDGET_VIEW = "application/vnd.jupyter.widget-view+json"


@pytest.fixture(scope="module")
def few(embedded):
    some = embedded.select([0, 70], "few")
    clips = tuple(clip.slice_frames(0, 130) for clip in some.clips)
    return replace(some, clips=clips)


@pytest.fixture(scope="module")
def one_lab(few):
    """Making a lab takes a while, so the tests share one and set what they need."""
    return Lab(few, channel=KNEE)


@pytest.fixture
def lab(one_lab, few, monkeypatch):
    one_lab.set_scene(clip=few.clips[0].name, noise="angular", amount=0.5, gap_s=0)
    one_lab.sigma_s, one_lab.look_ahead_s, one_lab.channel = 0.0315, None, KNEE
    one_lab.frame = 0
    one_lab.sent = []
    monkeypatch.setattr(one_lab, "send", one_lab.sent.append)
    return one_lab


def wish(lab, **wanted):
    """Send what the browser sends when a reader lets a control go."""
    lab._handle_custom_msg({"wish": wanted}, [])


def signals(lab):
    meta = lab._meta
    shape = (meta["frames"], len(meta["channels"]))
    return [values * SCALE for values in unpack_steps(lab._packed, [shape] * 5, np.int32)]


def test_the_browser_gets_the_curves(lab):
    scene = lab.scene
    motions = [scene.corrupted.clean, scene.filled, scene.cleaned["EBF"], scene.cleaned["Blend"]]
    *curves, widths_ms = signals(lab)
    for found, motion in zip(curves, motions, strict=True):
        np.testing.assert_allclose(found, motion.channels[:, scene.channels], atol=0.51 * SCALE)
    right = 1000 * scene.sigma_s[:, scene.channels]
    np.testing.assert_allclose(widths_ms, right, atol=0.51 * SCALE)
    assert lab._meta["channels"][0][2] == scene.filled.skeleton.channel_labels[scene.channels[0]]
    assert lab._meta["joints"][lab._meta["channels"][-1][0]] == "RThumb"


def test_every_light_control_goes_from_least_to_most(lab):
    for sigma_s in (WIDTHS_S[0], 0.032, WIDTHS_S[-1]):
        for look_ahead_s in (LOOK_AHEADS_S[0], 0.034, None):
            lab.set_state({"sigma_s": float(sigma_s), "look_ahead_s": look_ahead_s})
            assert np.isfinite(list(lab.errors_deg(KNEE).values())).all()
    lab.set_state({"sigma_s": 0.032, "look_ahead_s": 0.034})
    assert lab.sigma_s == 0.0315
    assert lab.look_ahead_s == 1 / 30
    for _, _, label in lab._meta["channels"]:
        lab.set_state({"channel": label})
        assert np.isfinite(list(lab.errors_deg(label).values())).all()
    for frame in (0, 70, 129):
        lab.set_state({"frame": frame})
        assert lab.frame == frame


@pytest.mark.parametrize("amount", [0, 0.5, max_amount("angular")])
def test_the_amount_goes_from_none_to_most(lab, amount):
    wish(lab, amount=amount)
    assert (lab.settings.noise, lab.settings.amount) == ("angular", amount)
    assert all(np.isfinite(values).all() for values in signals(lab))
    assert np.isfinite(lab._meta["gaussian_rms"]).all()
    assert lab.sent == []


@pytest.mark.parametrize("noise", [n for n in NOISES if n != "spatial"])
def test_every_noise_can_be_wished(lab, noise):
    wish(lab, noise=noise, amount=max_amount(noise))
    assert lab.settings.noise == noise
    assert lab._meta["rms"]["observed"] > 0
    assert lab.sent == []


def test_gaps_from_none_to_longest(lab):
    for gap_s, length in ((0, 0), (0.5, 60), (MAX_GAP_S, 120)):
        wish(lab, gap_s=gap_s)
        gaps = lab._meta["gaps"]
        assert bool(gaps) == (gap_s > 0)
        for place, start, stop in gaps:
            assert stop - start == length
            hidden = ~lab.scene.corrupted.mask[:, lab.scene.channels[place]]
            assert hidden[start:stop].all()
            assert hidden.sum() == length
    assert sum(values.size for values in signals(lab)) > 0


def test_another_clip_keeps_what_can_be_kept(lab, few):
    for clip in few.clips:
        wish(lab, clip=clip.name)
        assert lab.settings.clip == clip.name
        assert lab.channel == KNEE
    lab.frame = 129
    wish(lab, amount=0.1)
    assert lab.frame == 129


def test_a_wish_that_cannot_be_met_is_answered(lab):
    before = lab.scene
    wish(lab, amount=7)
    wish(lab, clip="nothing")
    wish(lab, colour="red")
    assert [list(message) for message in lab.sent] == [["error"]] * 3
    assert "amount must lie between 0 and 1, got 7" in lab.sent[0]["error"]
    assert "no clip 'nothing'" in lab.sent[1]["error"]
    assert lab.scene is before


def test_in_a_kernel_wishes_are_met_beside_the_main_path(lab):
    shown = []
    lab.observe(lambda change: shown.append(lab.settings.amount), names="_meta")

    async def session():
        wish(lab, amount=0.7)
        assert lab.settings.amount == 0.5  # the old picture stays
        for amount in (0.1, 0.2, 0.3):
            wish(lab, amount=amount)
        await lab._task

    asyncio.run(session())
    lab.unobserve_all("_meta")
    assert shown == [0.3]  # what was overtaken is never shown
    assert lab.sent == []


def test_200_moves_leave_no_figure(lab):
    for i in range(200):
        lab.set_state({"sigma_s": float(WIDTHS_S[i % len(WIDTHS_S)]), "frame": i % 130})
        if i % 100 == 0:
            wish(lab, amount=0.1 + 0.004 * i)
            lab.to_html()
    assert plt.get_fignums() == []


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("sigma_s", 32.0, "in seconds, over 0 and below 1; got 32"),
        ("sigma_s", 0.0, "got 0"),
        ("look_ahead_s", 2.0, "between 0 and 0.25 seconds, or is None; got 2"),
        ("channel", "LeftLeg", "a channel that moves in this clip, such as LeftUpLeg"),
        ("frame", 130, "between 0 and 129, got 130"),
    ],
)
def test_values_outside_are_refused(lab, name, value, message):
    with pytest.raises(traitlets.TraitError, match=message):
        setattr(lab, name, value)


def test_what_it_shows_itself_as(lab):
    assert repr(lab) == f"Lab({lab.settings.clip}, angular:0.5)"
    data, _ = lab._repr_mimebundle_()
    assert data[WIDGET_VIEW]["model_id"] == lab.model_id
    assert data["text/plain"] == repr(lab)
    assert "export default { render: renderLab }" in lab._esm


def test_a_page_has_all_it_needs_and_fetches_nothing(lab):
    lab.frame = 33
    text = lab.to_html()
    assert text == lab.to_html()
    found = re.search(r'\nmountLabs\("[\w-]+", (\{.*\}), "(.*)", "(.*)"\);\n', text)
    meta = json.loads(found[1])
    assert meta["start"] == {
        "sigma_s": 0.0315, "look_ahead_s": None, "channel": KNEE, "frame": 33,
    }  # fmt: skip
    assert {**meta, "start": None} == {**lab._meta, "start": None}
    assert base64.b64decode(found[2]) == lab._packed
    assert not re.search(r"https?://|\bimport\b[^\n]*from|import\(|fetch\(|@import|url\(", text)
    assert 'alt="Four pictures.' in text
    assert len(text) < 700_000
