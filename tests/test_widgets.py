"""The skeleton player, driven from Python; no browser takes part."""

from __future__ import annotations

import base64
import builtins
import importlib
import json
import re
import subprocess
import sys
from html.parser import HTMLParser

import numpy as np
import pytest

from mocaplab.kinematics import end_site_positions, forward_kinematics
from mocaplab.motion import Motion, Skeleton

pytest.importorskip("anywidget", reason="the player needs pip install 'mocaplab[lab]'")
import traitlets
from unpack import unpack_steps

from mocaplab.widgets import SkeletonPlayer, play

ROTATIONS = ("Zrotation", "Xrotation", "Yrotation")
LEG = Skeleton(
    joint_names=("Hips", "Knee", "Ankle", "Neck"),
    parents=np.array([-1, 0, 1, 0]),
    offsets=np.array([[0, 0, 0], [0, -40, 0], [0, -38, 2], [0, 50, 0]], dtype=float),
    channel_names=(("Xposition", "Yposition", "Zposition", *ROTATIONS), *[ROTATIONS] * 3),
    end_site_parents=np.array([2, 3]),
    end_site_offsets=np.array([[0, 0, 12], [0, 20, 0]], dtype=float),
)
WIDGET_VIEW = "application/vnd.jupyter.widget-view+json"


def swing(n_frames: int = 61, frame_time: float = 1 / 30, name: str = "swing") -> Motion:
    """A leg that swings while its hip moves forward."""
    time = np.arange(n_frames) * frame_time
    channels = np.zeros((n_frames, LEG.n_channels))
    channels[:, 1] = 80
    channels[:, 2] = 100 * time
    for k in range(3, LEG.n_channels):
        channels[:, k] = 30 * np.sin(2 * np.pi * time + k)
    return Motion(LEG, frame_time, channels, name)


def noisy(motion: Motion, seed: int = 0) -> Motion:
    rng = np.random.default_rng(seed)
    noise = rng.normal(0, 10, motion.channels.shape) * LEG.is_cleaned
    return motion.with_channels(motion.channels + noise)


def decode(meta: dict, packed: bytes) -> list[np.ndarray]:
    shapes = [(motion["frames"], motion["points"], 3) for motion in meta["motions"]]
    steps = unpack_steps(packed, shapes, np.int16)
    return [values * meta["scale"] + np.array(meta["origin"]) for values in steps]


def all_points(motion: Motion) -> np.ndarray:
    return np.concatenate([forward_kinematics(motion)[0], end_site_positions(motion)], axis=1)


def from_html(text: str) -> tuple[dict, bytes]:
    meta, data = re.search(r'\nmountAll\("[\w-]+", (\{.*\}), "(.*)"\);\n', text).groups()
    return json.loads(meta), base64.b64decode(data)


def test_frame_goes_from_first_to_last():
    player = play(swing())
    seen = []
    player.observe(lambda change: seen.append(change["new"]), names="frame")
    for frame in (30, 60, 0):
        player.frame = frame
        assert player.frame == frame
    assert seen == [30, 60, 0]


@pytest.mark.parametrize("frame", [-1, 61])
def test_frame_outside_the_clip_is_refused(frame):
    player = play(swing())
    with pytest.raises(traitlets.TraitError, match=f"between 0 and 60, got {frame}"):
        player.frame = frame
    assert player.frame == 0


def test_playing_and_speed():
    player = play(swing())
    assert (player.playing, player.speed) == (False, 1.0)
    player.playing = True
    for speed in (0.25, 2.0):
        player.speed = speed
    with pytest.raises(traitlets.TraitError):
        player.speed = 0.0


def test_a_joint_can_be_picked():
    player = play(swing())
    player.set_state({"picked": "Ankle"})
    assert player.picked == "Ankle"
    player.picked = ""
    with pytest.raises(traitlets.TraitError, match="name of a joint or '', got 'Elbow'"):
        player.picked = "Elbow"
    assert player._meta["motions"][0]["names"] == ["Hips", "Knee", "Ankle", "Neck"]


def test_what_the_browser_sends_reaches_python():
    player = play(swing())
    player.set_state({"frame": 12, "playing": True, "speed": 0.5})
    assert (player.frame, player.playing, player.speed) == (12, True, 0.5)


def test_positions_are_those_of_forward_kinematics():
    motions = swing(), noisy(swing())
    player = play(*motions)
    assert 0 < player.precision < 0.01
    for positions, motion in zip(decode(player._meta, player._packed), motions, strict=True):
        error = np.abs(positions - all_points(motion)).max()
        assert error <= player.precision * (1 + 1e-9)


def test_html_holds_the_same_data_as_the_widget():
    player = play(swing(), noisy(swing()), labels=["clean", "noisy"])
    assert from_html(player.to_html()) == (player._meta, player._packed)


def test_bones_join_parents_with_joints_and_end_sites():
    (motion,) = play(swing())._meta["motions"]
    assert motion["bones"] == [[0, 1], [1, 2], [0, 3], [2, 4], [3, 5]]
    assert (motion["joints"], motion["points"]) == (4, 6)


@pytest.mark.parametrize(
    ("fps", "step"), [(24, 1), (30, 1), (60, 1), (1 / 0.016667, 1), (100, 2), (120, 2), (240, 4)]
)
def test_fast_motions_are_thinned_to_60_fps(fps, step):
    motion = swing(n_frames=50, frame_time=1 / fps)
    player = play(motion)
    (positions,) = decode(player._meta, player._packed)
    np.testing.assert_allclose(positions, all_points(motion)[::step], atol=player.precision)
    player.frame = 49  # frames are still counted as in the motion
    assert player.step == step


def test_lengths_may_differ():
    player = play(swing(61), swing(20))
    assert repr(player) == "SkeletonPlayer(2 motions, 61 frames)"
    assert [motion["frames"] for motion in player._meta["motions"]] == [61, 20]


def test_one_frame_and_one_joint():
    dot = Skeleton(
        joint_names=("Root",),
        parents=np.array([-1]),
        offsets=np.zeros((1, 3)),
        channel_names=(("Xposition",),),
        end_site_parents=np.zeros(0, dtype=int),
        end_site_offsets=np.zeros((0, 3)),
    )
    player = play(Motion(dot, 1 / 30, np.array([[5.0]])))
    (positions,) = decode(player._meta, player._packed)
    np.testing.assert_allclose(positions, [[[5.0, 0.0, 0.0]]])
    assert player.to_html()


def test_ground_is_under_the_feet_and_noise_does_not_sink_it():
    still = Motion(LEG, 1 / 30, np.tile([0, 78.0, 0, *[0] * 12], (100, 1)))
    channels = still.channels.copy()
    channels[50, 1] = -500
    for motion in (still, still.with_channels(channels)):
        meta = play(motion)._meta
        assert meta["ground"] == pytest.approx(0)
        assert 100 < meta["size"] < 200
        assert meta["cell"] in (20, 50)


def test_repr_is_fixed():
    assert repr(play(swing())) == "SkeletonPlayer(1 motion, 61 frames)"
    assert repr(play(swing(), noisy(swing()))) == "SkeletonPlayer(2 motions, 61 frames)"


def test_mimebundle_has_the_widget_and_the_html():
    player = play(swing())
    data, _ = player._repr_mimebundle_()
    assert data[WIDGET_VIEW]["model_id"] == player.model_id
    assert data["text/plain"] == repr(player)
    assert data["text/html"] == player.to_html()


def test_html_is_the_same_every_time_and_differs_with_the_content():
    first = play(swing(), labels=["a"]).to_html()
    assert first == play(swing(), labels=["a"]).to_html()
    ids = {
        re.search(r'class="(mocaplab-player-\w+)"', text).group(1)
        for text in (
            first,
            play(swing(), labels=["b"]).to_html(),
            play(noisy(swing()), labels=["a"]).to_html(),
            play(swing(), labels=["a"], height=300).to_html(),
        )
    }
    assert len(ids) == 4


def test_html_fetches_nothing_and_is_small():
    text = play(swing(400), noisy(swing(400))).to_html()
    addresses = set(re.findall(r"https?://[^\s\"']+", text))
    assert not addresses
    assert not re.search(r"\bimport\b[^\n]*from|import\(|fetch\(|@import|url\(", text)
    assert len(text) < 100_000


def test_labels_cannot_break_the_page():
    label = "</script><img src=x onerror=alert(1)>"
    text = play(swing(), labels=[label]).to_html()
    tags = []

    class Tags(HTMLParser):
        def handle_starttag(self, tag, attrs):
            tags.append(tag)

    Tags().feed(text)
    assert tags == ["div", "img", "br", "em", "script"]
    assert from_html(text)[0]["motions"][0]["label"] == label


def test_still_picture_shows_where_scripts_may_not_run():
    text = play(swing(), noisy(swing())).to_html()
    svg = base64.b64decode(re.search(r'src="data:image/svg\+xml;base64,(.*?)"', text).group(1))
    assert svg.count(b"<path") == 10  # five poses of two motions
    assert b"nan" not in svg


def test_labels_by_default():
    assert play(swing(name="walk"), swing(name="run")).labels == ("walk", "run")
    assert play(swing(name="walk"), swing(name="walk")).labels == ("walk (1)", "walk (2)")
    assert play(swing(name="")).labels == ("motion 1",)


def with_nan(frame: int) -> Motion:
    channels = swing().channels.copy()
    channels[frame, 6] = np.nan
    return swing().with_channels(channels)


@pytest.mark.parametrize(
    ("motions", "options", "message"),
    [
        ([], {}, "expected 1 to 4 motions, got 0"),
        ([swing()] * 5, {}, "expected 1 to 4 motions, got 5"),
        ([[swing(), swing()]], {}, r"expected motions, as in play\(clean, noisy\); got a list"),
        (
            [swing(), swing(frame_time=0.01)],
            {},
            r"expected one frame time, 0\.0333+ s as in the first motion; got 0\.01 s in motion 2",
        ),
        (
            [swing(), with_nan(7)],
            {},
            r"got NaN in motion 2 at frame 7, channel Knee\.Zrotation; fill the gaps first",
        ),
        ([swing()], {"labels": ["a", "b"]}, r"expected 1 labels, one a motion; got \['a', 'b'\]"),
        ([swing()], {"labels": "a"}, "got 'a'"),
        ([swing()], {"height": 20}, "at least 100 pixels, got 20"),
    ],
)
def test_errors_say_what_was_expected(motions, options, message):
    with pytest.raises(ValueError, match=message):
        play(*motions, **options)


def test_without_anywidget_the_message_names_the_extra(monkeypatch):
    real = builtins.__import__

    def without_anywidget(name, *args, **kwargs):
        if name == "anywidget":
            raise ImportError(f"No module named {name!r}", name=name)
        return real(name, *args, **kwargs)

    module = sys.modules["mocaplab.widgets"]
    monkeypatch.delitem(sys.modules, "mocaplab.widgets")
    monkeypatch.setattr(builtins, "__import__", without_anywidget)
    with pytest.raises(ImportError, match=r"anywidget.*pip install 'mocaplab\[lab\]'"):
        importlib.import_module("mocaplab.widgets")
    monkeypatch.setattr("mocaplab.widgets", module, raising=False)


def test_importing_the_player_leaves_torch_alone():
    code = "import sys, mocaplab.widgets; sys.exit('torch' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_player_is_a_widget():
    assert isinstance(play(swing()), SkeletonPlayer)
    assert "export default" in play(swing())._esm
