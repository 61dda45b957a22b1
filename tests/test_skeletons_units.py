"""The length unit of a file."""

from dataclasses import replace

import numpy as np
import pytest

from data_tools.asf import load_asf
from data_tools.asfamc import asf_to_skeleton
from mocaplab.bvh import load_bvh
from mocaplab.skeletons.units import LEG_CM, cm_per_unit, leg_length


def test_leg_of_a_known_skeleton(small_motion):
    # Hips to Leg: offset (9, -5, 0)
    assert leg_length(small_motion.skeleton) == pytest.approx(np.hypot(9, 5))


def test_embedded_clips_have_cmus_unit(walk):
    assert cm_per_unit(walk.skeleton) == pytest.approx(2.54 / 0.45)


@pytest.mark.parametrize("unit", [0.1, 1.0, 2.54, 2.54 / 0.45, 100.0])
@pytest.mark.parametrize("body", [0.75, 1.0, 1.2])
def test_every_unit_is_found_for_small_and_tall_bodies(walk, unit, body):
    factor = body * 2.54 / 0.45 / unit
    skeleton = replace(walk.skeleton, offsets=walk.skeleton.offsets * factor)
    assert cm_per_unit(skeleton) == unit


def test_no_length_fits_two_units():
    low, high = LEG_CM
    units = np.sort([0.1, 1.0, 2.54, 2.54 / 0.45, 100.0])
    assert high / low < (units[1:] / units[:-1]).min()


def test_a_giant_is_refused_and_the_message_says_what_to_pass(walk):
    skeleton = replace(walk.skeleton, offsets=walk.skeleton.offsets * 3)
    with pytest.raises(ValueError, match=r"leg of 75 to 135 cm, got .* pass cm_per_unit"):
        cm_per_unit(skeleton)


def test_a_body_without_legs_is_refused(walk):
    skeleton = replace(walk.skeleton, offsets=np.abs(walk.skeleton.offsets))
    with pytest.raises(ValueError, match="no joint below the root"):
        cm_per_unit(skeleton)


def test_real_files(data_dir):
    cmu = load_bvh(data_dir / "cmu" / "walk_01.bvh")
    daz = load_bvh(data_dir / "cmu_daz" / "salsa_10.bvh")
    assert cm_per_unit(cmu.skeleton) == pytest.approx(5.6444, abs=1e-4)
    assert cm_per_unit(daz.skeleton) == 1.0


def test_agrees_with_what_an_acclaim_file_says_about_itself(data_dir):
    acclaim = load_asf(data_dir / "cmu_asfamc" / "02.asf")
    assert cm_per_unit(asf_to_skeleton(acclaim)) == pytest.approx(acclaim.cm_per_unit)
