"""Parameters of the report's search, and its variants against the defect of the track ends."""

from dataclasses import dataclass

#: Minimum duration of a segment, section 2.5, s.
SEGMENT_MIN_S = 10.0


@dataclass(frozen=True, slots=True)
class SearchRules:
    """Variants of the report against the defect of its search, section 2.7.2.

    Attributes
    ----------
    last_segment_s : float
        Minimum duration of the last segment.
    last_plot : float
        Information factor of the last plot.
    dimples : bool
        Whether a plot attracts a track only from nearby: each term of the functional is a dimple,
        ln 2 deep and flat beyond some two sigmas.

    References
    ----------
    IMM UrO RAN report (2016), section 2.7.2, which names the dimples only; their shape is the
    project's own.
    """

    last_segment_s: float = SEGMENT_MIN_S
    last_plot: float = 1.0
    dimples: bool = False
