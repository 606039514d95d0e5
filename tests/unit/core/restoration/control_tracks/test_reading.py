"""Kinds of motion of tracks of the kernels at a time."""

import numpy as np

from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks.reading import kinds_at


def test_the_kind_is_that_of_the_last_segment_that_has_started() -> None:
    """Rows after the last segment contain old numbers."""
    tracks = np.zeros((2, layout.TRACK_COUNT))
    tracks[:, layout.COUNT] = 2.0, 3.0
    segments = tracks[:, layout.SEGMENTS : layout.PRIOR_MEAN].reshape(2, layout.SEGMENTS_MAX, -1)
    # The start of the first segment is undefined.
    segments[:, :3, layout.BEGIN] = 99.0, 10.0, 20.0
    segments[:, :3, layout.KIND] = layout.STRAIGHT, layout.LEFT, layout.FASTER
    tracks[:, layout.SEGMENTS : layout.PRIOR_MEAN] = segments.reshape(2, -1)
    assert kinds_at(tracks, 9.9).tolist() == [layout.STRAIGHT, layout.STRAIGHT]
    assert kinds_at(tracks, 10.0).tolist() == [layout.LEFT, layout.LEFT]
    assert kinds_at(tracks, 25.0).tolist() == [layout.LEFT, layout.FASTER]
