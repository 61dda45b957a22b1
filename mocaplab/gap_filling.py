"""Gap filling one channel at a time: straight lines and cubic curves between observed samples."""

from __future__ import annotations

import numpy as np

from mocaplab.motion import Motion


def lerp_gaps(motion: Motion) -> Motion:
    """Fill gaps (NaN) by straight lines between their ends.

    A gap at the start or the end of the clip is filled with the nearest observed value.

    Raises
    ------
    ValueError
        If a channel was never observed; the message names it.
    """
    channels = motion.channels.copy()
    frames = np.arange(len(channels))
    for channel in np.flatnonzero(np.isnan(channels).any(axis=0)):
        observed = ~np.isnan(channels[:, channel])
        if not observed.any():
            label = motion.skeleton.channel_labels[channel]
            raise ValueError(f"channel {label} was never observed, so its gaps cannot be filled")
        channels[:, channel] = np.interp(frames, frames[observed], channels[observed, channel])
    return motion.with_channels(channels)
