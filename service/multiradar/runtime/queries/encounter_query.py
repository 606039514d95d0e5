"""Which encounters are asked for, the same over HTTP, over Zenoh and of a recording."""

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
        Maximum number of encounters; None is no limit.

    Raises
    ------
    ForecastError
        If a number is out of its bounds or none.
    """

    horizon_s: float = ENCOUNTER_HORIZON_S
    distance_m: float = ENCOUNTER_DISTANCE_M
    height_m: float | None = None
    probability_min: float = 0.0
    order: str = BY_TIME
    limit: int | None = ENCOUNTERS_DEFAULT

    def __post_init__(self) -> None:
        checked(ENCOUNTERS, asdict(self))
