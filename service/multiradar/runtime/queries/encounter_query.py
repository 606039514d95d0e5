"""What may be asked of encounters, the same over HTTP, over Zenoh and of a recording."""

from dataclasses import dataclass

from multiradar.errors import ForecastError

#: Bounds of what may be asked for, and what is taken where nothing is said, for everybody.
HORIZON_DEFAULT_S = 120.0
HORIZON_MIN_S, HORIZON_MAX_S = 1.0, 600.0
#: Five nautical miles: how far apart aircraft are kept on their way.
DISTANCE_DEFAULT_M = 9260.0
DISTANCE_MIN_M, DISTANCE_MAX_M = 1.0, 100_000.0
HEIGHT_MIN_M, HEIGHT_MAX_M = 1.0, 20_000.0
LIMIT_DEFAULT = 100
LIMIT_MAX = 10_000
BY_TIME, BY_PROBABILITY = "time", "probability"
ORDERS = (BY_TIME, BY_PROBABILITY)


@dataclass(frozen=True, slots=True)
class EncounterQuery:
    """Which encounters are asked for.

    Attributes
    ----------
    horizon_s : float
        How far ahead, s.
    distance_m : float
        Pairs whose expected positions come so near, m.
    height_m : float or None
        Without those whose heights are expected to be farther apart, m, all the while that they are
        within `distance_m`; those of unknown height stay.
    probability_min : float
        Without those that are less likely to come within both (`distance_m` where a height is not
        known, or `height_m` not given).
    order : str
        `time` of the closest approach, or `probability`, the greatest first.
    limit : int or None
        Most encounters that are told of; None tells all.

    Raises
    ------
    ForecastError
        If a number is out of its bounds or none.
    """

    horizon_s: float = HORIZON_DEFAULT_S
    distance_m: float = DISTANCE_DEFAULT_M
    height_m: float | None = None
    probability_min: float = 0.0
    order: str = BY_TIME
    limit: int | None = LIMIT_DEFAULT

    def __post_init__(self) -> None:
        _require_between("horizon_s", self.horizon_s, HORIZON_MIN_S, HORIZON_MAX_S)
        _require_between("distance_m", self.distance_m, DISTANCE_MIN_M, DISTANCE_MAX_M)
        if self.height_m is not None:
            _require_between("height_m", self.height_m, HEIGHT_MIN_M, HEIGHT_MAX_M)
        if not 0.0 <= self.probability_min <= 1.0:
            raise ForecastError("probability_min", f"expected 0 to 1, was {self.probability_min}")
        if self.order not in ORDERS:
            raise ForecastError("order", f"expected one of {', '.join(ORDERS)}, was {self.order}")
        if self.limit is not None and not 1 <= self.limit <= LIMIT_MAX:
            raise ForecastError("limit", f"expected 1 to {LIMIT_MAX}, was {self.limit}")


def _require_between(name: str, value: float, least: float, most: float) -> None:
    # Written so that NaN fails.
    if not least <= value <= most:
        raise ForecastError(name, f"expected {least:g} to {most:g}, was {value}")
