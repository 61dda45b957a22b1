"""Which channels a filler should predict from the rest of the pose."""

from __future__ import annotations

import numpy as np

from mocaplab.motion import BoolArray, Motion, moving_channels

WIDEST_DEG = 270.0
"""No joint of a body turns so far. An angle that does has been counted in whole turns."""


def pose_channels(motion: Motion) -> BoolArray:
    """Tell which channels the rest of the pose says something about, shape (C,).

    These move, and do not turn all the way round. The thumb of many a capture does: its angle
    climbs by 360 degrees and more, and no pose tells how many turns it has made. Of such a
    channel a straight line knows more.

    Parameters
    ----------
    motion : Motion, with continuous angles; NaN inside gaps
    """
    follows = moving_channels(motion)
    turning = np.flatnonzero(follows & motion.skeleton.is_rotation)
    for channel in turning:
        # Without the outer tenth of the samples, so that noise and spikes do not count as turns.
        low, high = np.nanpercentile(motion.channels[:, channel], [5, 95])
        follows[channel] = high - low <= WIDEST_DEG
    return follows
