"""Joints of files found in a model's skeleton by their names."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocaplab.bvh import load_bvh
from mocaplab.motion import Skeleton
from mocaplab.skeletons.as_json import skeleton_from_json, skeleton_to_json
from mocaplab.skeletons.matching import match_skeletons


@pytest.fixture
def skeleton(walk):
    return walk.skeleton


@pytest.fixture
def constant(skeleton):
    """No channel but those of LHipJoint and RHipJoint stood still in training."""
    return np.isin(skeleton.channel_joint, [1, 6])


def renamed(skeleton, change):
    return replace(skeleton, joint_names=tuple(change(name) for name in skeleton.joint_names))


def without(skeleton, names):
    """Leave out joints that have no children."""
    keep = [j for j, name in enumerate(skeleton.joint_names) if name not in names]
    new = {old: i for i, old in enumerate(keep)}
    sites = [s for s, p in enumerate(skeleton.end_site_parents) if int(p) in new]
    return Skeleton(
        tuple(skeleton.joint_names[j] for j in keep),
        np.array([-1 if j == 0 else new[int(skeleton.parents[j])] for j in keep]),
        skeleton.offsets[keep],
        tuple(skeleton.channel_names[j] for j in keep),
        np.array([new[int(skeleton.end_site_parents[s])] for s in sites]),
        skeleton.end_site_offsets[sites],
    )


def with_child(skeleton, parent, name):
    """Add a joint that turns at the end."""
    return replace(
        skeleton,
        joint_names=(*skeleton.joint_names, name),
        parents=np.append(skeleton.parents, skeleton.joint_names.index(parent)),
        offsets=np.vstack([skeleton.offsets, [1.0, 0.0, 0.0]]),
        channel_names=(*skeleton.channel_names, ("Zrotation", "Xrotation", "Yrotation")),
    )


def test_equal_skeletons_are_taken_as_they_are(walk, skeleton, constant):
    match = match_skeletons(skeleton, skeleton, constant)
    assert match.is_identity
    assert match.to_model(walk.channels) is walk.channels
    assert match.describe() == []


@pytest.mark.parametrize(
    "change", [str.lower, lambda name: f"mixamorig:{name}", lambda name: f"Character1_{name}"]
)
def test_case_and_prefix_do_not_count(change, walk, skeleton, constant):
    match = match_skeletons(renamed(skeleton, change), skeleton, constant)
    assert match.pairs == {j: j for j in range(31)}
    np.testing.assert_array_equal(match.to_model(walk.channels), walk.channels)
    assert f"{change('LeftLeg')} = LeftLeg" in "\n".join(match.describe())


def test_other_orders_are_the_same_rotations(walk, skeleton, constant):
    orders = ("Xrotation", "Yrotation", "Zrotation")
    file = replace(skeleton, channel_names=(skeleton.channel_names[0], *[orders] * 30))
    match = match_skeletons(file, skeleton, constant)
    rng = np.random.default_rng(0)
    channels = walk.channels + rng.normal(size=walk.channels.shape)
    translated = match.to_model(channels)
    np.testing.assert_array_equal(translated[:, :6], channels[:, :6])
    here = Rotation.from_euler("XYZ", channels[:, 6:].reshape(-1, 3), degrees=True)
    there = Rotation.from_euler("ZYX", translated[:, 6:].reshape(-1, 3), degrees=True)
    assert (here.inv() * there).magnitude().max() < 1e-9
    assert np.abs(np.diff(translated, axis=0)).max() < 90  # continuous
    np.testing.assert_allclose(match.to_file(translated, channels), channels, atol=1e-8)
    assert "30 joints are converted: XYZ -> ZYX" in match.describe()


def test_what_holds_for_an_angle_holds_for_all_three_after_conversion(skeleton, constant):
    orders = ("Xrotation", "Yrotation", "Zrotation")
    names = list(skeleton.channel_names)
    names[3] = orders  # LeftLeg
    file = replace(skeleton, channel_names=tuple(names))
    match = match_skeletons(file, skeleton, constant)
    hidden = np.zeros((2, 96), dtype=bool)
    hidden[0, file.channel_index("LeftLeg.Yrotation")] = True
    hidden[1, file.channel_index("LeftFoot.Yrotation")] = True
    marked = match.spread(hidden)
    of_leg = [skeleton.channel_index(f"LeftLeg.{kind}") for kind in orders]
    assert marked[0].sum() == 3
    assert marked[0, of_leg].all()
    assert marked[1].sum() == 1
    assert match.spread_back(marked)[0].sum() == 3


def test_fingers_may_be_missing_and_others_may_be_there(walk, skeleton, constant):
    lost = {"LThumb", "LeftHandIndex1"}
    file = with_child(without(skeleton, lost), "LeftHand", "LeftPinky")
    match = match_skeletons(file, skeleton, constant)
    assert match.unknown_joints == ["LeftPinky"]
    assert set(match.missing_joints) == lost
    channels = np.random.default_rng(0).normal(size=(5, file.n_channels))
    translated = match.to_model(channels)
    column = skeleton.channel_index("RightHand.Xrotation")
    expected = channels[:, file.channel_index("RightHand.Xrotation")]
    np.testing.assert_array_equal(translated[:, column], expected)
    assert not translated[:, skeleton.channel_index("LThumb.Xrotation")].any()
    np.testing.assert_array_equal(match.to_file(translated, channels), channels)
    text = "\n".join(match.describe())
    assert "smoothed with one Gaussian: LeftPinky" in text
    assert "not in the file: LeftHandIndex1, LThumb" in text


def test_a_hinge_is_its_axis(skeleton, constant):
    names = list(skeleton.channel_names)
    names[3] = ("Xrotation",)
    names[4] = ("Zrotation", "Xrotation")
    file = replace(skeleton, channel_names=tuple(names))
    match = match_skeletons(file, skeleton, constant)
    channels = np.arange(file.n_channels, dtype=float)[None]
    x = match.to_model(channels)[0, skeleton.channel_index("LeftLeg.Xrotation")]
    assert x == channels[0, file.channel_index("LeftLeg.Xrotation")]
    assert match.unknown_joints == ["LeftFoot"]  # two of three angles cannot be translated


def refusal(file, model, constant):
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        match_skeletons(file, model, constant)
    return str(caught.value)


def test_what_is_not_safe_is_refused(skeleton, constant, small_motion):
    message = refusal(renamed(skeleton, lambda n: n.replace("Leg", "Shin")), skeleton, constant)
    assert message.startswith("it has no joint LeftUpLeg, LeftLeg, RightUpLeg, RightLeg")
    message = refusal(renamed(skeleton, lambda n: n.replace("Hips", "Pelvis")), skeleton, constant)
    assert message == "its root is Pelvis, that of the model Hips"
    assert "no joint" in refusal(small_motion.skeleton, skeleton, constant)
    turned = replace(skeleton, offsets=skeleton.offsets[:, [0, 2, 1]])  # Z is up
    assert "the rest poses differ" in refusal(renamed(turned, str.lower), skeleton, constant)


def test_a_joint_in_another_place_is_refused(skeleton, constant):
    parents = skeleton.parents.copy()
    hand, spine = (skeleton.joint_names.index(n) for n in ("LeftHand", "Spine1"))
    parents[hand] = spine
    moved = renamed(replace(skeleton, parents=parents), str.lower)
    message = refusal(moved, skeleton, constant)
    assert message == "its lefthand hangs on spine1, that of the model on LeftForeArm"


def test_a_joint_between_known_ones_is_refused(skeleton, constant):
    small = without(skeleton, {"LThumb"})
    model_without = Skeleton(
        small.joint_names,
        small.parents,
        small.offsets,
        small.channel_names,
        small.end_site_parents,
        small.end_site_offsets,
    )
    names = [n for n in small.joint_names]
    neck = names.index("Neck1")
    names[neck] = "Extra"
    file = replace(small, joint_names=tuple(names))
    still = np.isin(model_without.channel_joint, [1, 6, neck])
    message = refusal(file, model_without, still)
    assert "it has Extra between" in message
    assert "and Head" in message


def test_the_dance_of_another_family_of_skeletons_is_refused(data_dir, skeleton, constant):
    daz = load_bvh(data_dir / "cmu_daz" / "salsa_10.bvh")
    assert "its root is" in refusal(daz.skeleton, skeleton, constant)


def test_a_skeleton_survives_json(skeleton, small_motion):
    for each in (skeleton, small_motion.skeleton):
        back = skeleton_from_json(skeleton_to_json(each))
        assert back.same_as(each)
        np.testing.assert_array_equal(back.offsets, each.offsets)
        np.testing.assert_array_equal(back.end_site_offsets, each.end_site_offsets)
    with pytest.raises(ValueError, match="not the data of a skeleton"):
        skeleton_from_json({"joint_names": ["Hips"]})
