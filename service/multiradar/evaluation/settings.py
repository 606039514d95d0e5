"""Settings of an evaluation."""

from dataclasses import dataclass, fields

from multiradar.errors import ConfigurationError
from multiradar_schemas.bounds import ROTATION_PERIOD_S


@dataclass(frozen=True, slots=True)
class EvaluationSettings:
    """How tracks are compared with a reference.

    Attributes
    ----------
    step_s : float
        Time between the instants at which tracks are assigned to aircraft, s.
    gate_m : float
        Association radius: a track farther from an aircraft is not assigned to it, m.
    age_max_s : float
        Maximum extrapolation time of a track from its last update, s.
    reference_gap_s : float
        The reference is not interpolated between positions farther apart, s.
    cutoff_m, order : float
        c and p of OSPA and GOSPA: m, and at least 1.
    dwell_s : float
        A track that is nearest to another aircraft for less than this has not swapped, s.
    gap_s : float
        Shortest interval between two updates of an aircraft that counts as a gap, s.
    settling_s : float
        Updates in the first seconds of a track do not count as errors, s.
    reference_sigma_m : float
        Error of the reference itself, square root of the trace of its covariance, m; it is added
        to the reported covariance of tracks.
    density : float
        Spectral density of the acceleration of aircraft for smoothing a reference, m²/s³.
    scan_period_s : float, optional
        Scan period of a radar, s, to express delays in scans.
    partial : bool
        Whether the reference may lack aircraft: a track that matches none is then not evaluated.
    tentative : bool
        Whether tentative tracks count.
    whole_reference : bool
        Whether positions of the reference outside the coverage of the sensors count, too.

    Raises
    ------
    ConfigurationError
        A value is out of its bounds, or not a number.
    """

    step_s: float = 4.0
    gate_m: float = 2000.0
    age_max_s: float = 12.0
    reference_gap_s: float = 15.0
    cutoff_m: float = 1000.0
    order: float = 2.0
    dwell_s: float = 20.0
    gap_s: float = 16.4
    settling_s: float = 0.0
    reference_sigma_m: float = 0.0
    density: float = 30.0
    scan_period_s: float | None = None
    partial: bool = False
    tentative: bool = False
    whole_reference: bool = False

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            if value is None or isinstance(value, bool):
                continue
            least, most, unit = _BOUNDS[one.name]
            good = value > 0.0 if one.name in _ABOVE else value >= least
            if not (good and value <= most):
                end = f"{most:,.0f}".replace(",", " ")
                expected = f"from {least:g} to {end}"
                if one.name in _ABOVE:
                    expected = f"above 0 and at most {end}"
                msg = f"{one.name}: expected a number {expected}{unit}, was {value:g}"
                raise ConfigurationError(msg)


#: Least and greatest value, and the unit: what is beyond has no effect, or makes every track match.
_BOUNDS = {
    "step_s": (0.0, 86_400.0, " s"),
    "gate_m": (1.0, 1e6, " m"),
    "age_max_s": (0.1, 3600.0, " s"),
    "reference_gap_s": (0.1, 3600.0, " s"),
    "cutoff_m": (1.0, 1e6, " m"),
    "order": (1.0, 100.0, ""),
    "dwell_s": (0.0, 86_400.0, " s"),
    "gap_s": (0.1, 86_400.0, " s"),
    "settling_s": (0.0, 1e6, " s"),
    "reference_sigma_m": (0.0, 1e5, " m"),
    "density": (1e-4, 1e6, " m²/s³"),
    "scan_period_s": (ROTATION_PERIOD_S.least, ROTATION_PERIOD_S.most, " s"),
}
_ABOVE = ("step_s",)
