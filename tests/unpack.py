"""Undo the packing of mocaplab.packing, written apart from it."""

from __future__ import annotations

import zlib

import numpy as np


def unpack_steps(packed, shapes, dtype):
    """Return the arrays of these shapes: zlib, byte planes, differences."""
    size = np.dtype(dtype).itemsize
    planes = np.frombuffer(zlib.decompress(packed), dtype=np.uint8).reshape(size, -1)
    unsigned = f"u{size}"
    differences = sum(plane.astype(unsigned) << (8 * b) for b, plane in enumerate(planes))
    arrays, start = [], 0
    for shape in shapes:
        part = differences[start : start + np.prod(shape)].reshape(shape)
        start += part.size
        arrays.append(np.cumsum(part, axis=0, dtype=unsigned).view(dtype))  # wraps
    assert start == differences.size
    return arrays
