"""Selection of encounters, the same over HTTP, over Zenoh and offline."""

from dataclasses import asdict, dataclass

from multiradar.runtime.queries.parameters import (
    BY_TIME,
    ENCOUNTER_DISTANCE_M,
    ENCOUNTER_HORIZON_S,
    ENCOUNTERS,
    ENCOUNTERS_DEFAULT,
    checked,
)


@dataclass(frozen=True, slots=True)
class EncounterQuery:
    """Selection of encounters.

    Attributes
    ----------
    horizon_s : float
        Prediction horizon, s.
    distance_m : float
        Horizontal threshold: pairs whose predicted positions come closer, m.
    height_m : float or None
        Vertical threshold, m: skip pairs separated by more while within `distance_m`; pairs of
        unknown height are kept.
    probability_min : float
        Skip pairs with a lower probability of coming within both thresholds (`distance_m` alone
        where a height is unknown or `height_m` is not given).
    order : str
        `time` of closest approach, or `probability`, greatest first.
    limit : int or None
        Maximum number of encounters; None is no limit.

    Raises
    ------
    ForecastError
        If a number is out of its bounds or NaN.
    """

    horizon_s: float = ENCOUNTER_HORIZON_S
    distance_m: float = ENCOUNTER_DISTANCE_M
    height_m: float | None = None
    probability_min: float = 0.0
    order: str = BY_TIME
    limit: int | None = ENCOUNTERS_DEFAULT

    def __post_init__(self) -> None:
        checked(ENCOUNTERS, asdict(self))
