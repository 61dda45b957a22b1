"""Numbers on their way into a web page: small, and unpacked by static/common.js."""

from __future__ import annotations

import base64
import hashlib
import json
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

_STATIC = Path(__file__).with_name("static")


def pack_steps(arrays: Sequence[np.ndarray[Any, np.dtype[np.signedinteger[Any]]]]) -> bytes:
    """Pack whole numbers that change little from frame to frame.

    What is kept are differences from frame to frame (they wrap around, as in the browser),
    all low bytes first, then all higher ones, compressed with zlib.

    Parameters
    ----------
    arrays : list of arrays, shape (T, ...), all int16 or all int32; frames come first
    """
    differences = [np.diff(v, axis=0, prepend=np.zeros_like(v[:1])).ravel() for v in arrays]
    whole = np.concatenate(differences)
    little = whole.astype(whole.dtype.newbyteorder("<"))
    planes = little.view(np.uint8).reshape(-1, whole.itemsize).T
    return zlib.compress(planes.tobytes(), 9)


def javascript(*names: str) -> str:
    """Join files of ``static/`` into one module, in this order; none of them imports."""
    return "\n".join(_STATIC.joinpath(f"{name}.js").read_text("utf-8") for name in names)


def page_html(
    kind: str,
    files: Sequence[str],
    function: str,
    meta: Mapping[str, Any],
    packed: Sequence[bytes],
    still: str,
) -> str:
    """Make HTML that works with no kernel and no network, the same for the same content.

    Parameters
    ----------
    kind : str, for the name of the element's class
    files : names of files in ``static/``, joined in this order
    function : str, the exported function that fills the element
    meta : JSON-able, its second argument
    packed : list of bytes, its further arguments, in base64
    still : str, HTML that shows where scripts may not run
    """
    code = javascript(*files)
    text = json.dumps(meta).replace("<", "\\u003c")  # no label ends the script
    digest = hashlib.sha256((text + code).encode() + b"".join(packed)).hexdigest()[:16]
    name = f"mocaplab-{kind}-{digest}"
    data = ", ".join(f'"{base64.b64encode(each).decode()}"' for each in packed)
    return (
        f'<div class="{name}">{still}</div>\n'
        f'<script type="module">\n{code}\n'
        f'{function}("{name}", {text}, {data});\n</script>'
    )
