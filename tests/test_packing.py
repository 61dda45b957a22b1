"""Packed numbers are unpacked by hand, and by the browser's own code where node is there."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import zlib

import numpy as np
import pytest

from mocaplab.packing import javascript, pack_steps, page_html


def test_two_frames_by_hand():
    packed = pack_steps([np.array([[1, 300], [2, 299]], dtype=np.int16)])
    # Differences 1, 300, 1, -1: low bytes, then high bytes.
    assert zlib.decompress(packed) == bytes([1, 44, 1, 255, 0, 1, 0, 255])


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
@pytest.mark.parametrize(("dtype", "size"), [(np.int16, 2), (np.int32, 4)])
def test_the_browser_unpacks_what_was_packed(dtype, size):
    rng = np.random.default_rng(0)
    info = np.iinfo(dtype)
    arrays = [
        rng.integers(info.min, info.max, size=shape, dtype=dtype, endpoint=True)
        for shape in ((50, 3), (1, 7), (20, 2))
    ]
    text = base64.b64encode(pack_steps(arrays)).decode()
    shapes = [list(array.shape) for array in arrays]
    code = (
        f"{javascript('common')}\nconst found = await unpackSteps(bytesOf('{text}'), "
        f"{shapes}, {size});\nconsole.log(JSON.stringify(found.map((v) => [...v])));"
    )
    command = ["node", "--input-type=module"]
    run = subprocess.run(command, input=code, capture_output=True, text=True, check=True)
    for found, array in zip(json.loads(run.stdout), arrays, strict=True):
        np.testing.assert_array_equal(found, array.ravel())


def test_a_page_has_the_data_and_an_id_of_its_content():
    pages = [
        page_html("lab", ["common"], "fill", {"a": text}, [b"xy"], "<b>still</b>")
        for text in ("one", "</script>", "one")
    ]
    assert pages[0] == pages[2] != pages[1]
    assert '<div class="mocaplab-lab-' in pages[0]
    assert "<b>still</b>" in pages[0]
    assert 'fill("mocaplab-lab-' in pages[0]
    assert pages[0].rstrip().endswith('{"a": "one"}, "eHk=");\n</script>')
    assert pages[1].count("</script>") == 1
