"""What the report's search holds to, and what it considers against the defect of its ends."""

from dataclasses import dataclass

#: Least duration of a segment, section 2.5, s.
SEGMENT_MIN_S = 10.0


@dataclass(frozen=True, slots=True)
class SearchRules:
    """What the report varies against the defect of its search, section 2.7.2.

    Attributes
    ----------
    last_segment_s : float
        Least duration of the last segment.
    last_plot : float
        Factor of the information of the last plot.
    dimples : bool
        Whether a plot draws a track only from near: each part of the functional is a dimple, as
        deep as ln 2 and flat beyond some two sigmas.

    References
    ----------
    IMM UrO RAN report (2016), section 2.7.2. The shape of the dimples is the project's own: the
    report names them and tells no more.
    """

    last_segment_s: float = SEGMENT_MIN_S
    last_plot: float = 1.0
    dimples: bool = False
