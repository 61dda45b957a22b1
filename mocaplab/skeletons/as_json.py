"""A skeleton as JSON can hold it: model files keep the one that they were trained on."""

from __future__ import annotations

from typing import Any

import numpy as np

from mocaplab.motion import Skeleton


def skeleton_to_json(skeleton: Skeleton) -> dict[str, Any]:
    """Return lists and texts that say all of a skeleton."""
    return {
        "joint_names": list(skeleton.joint_names),
        "parents": skeleton.parents.tolist(),
        "offsets": skeleton.offsets.tolist(),
        "channel_names": [list(names) for names in skeleton.channel_names],
        "end_site_parents": skeleton.end_site_parents.tolist(),
        "end_site_offsets": skeleton.end_site_offsets.tolist(),
    }


def skeleton_from_json(data: dict[str, Any]) -> Skeleton:
    """Undo :func:`skeleton_to_json`.

    Raises
    ------
    ValueError
        If these are not the data of a skeleton.
    """
    try:
        return Skeleton(
            joint_names=tuple(data["joint_names"]),
            parents=np.array(data["parents"], dtype=np.int64),
            offsets=np.array(data["offsets"], dtype=np.float64).reshape(-1, 3),
            channel_names=tuple(tuple(names) for names in data["channel_names"]),
            end_site_parents=np.array(data["end_site_parents"], dtype=np.int64),
            end_site_offsets=np.array(data["end_site_offsets"], dtype=np.float64).reshape(-1, 3),
        )
    except (KeyError, TypeError) as error:
        raise ValueError(f"not the data of a skeleton ({error})") from None
