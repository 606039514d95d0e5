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
    """Selection of encounters: values of the parameters `ENCOUNTERS`, which describe them.

    Here `limit` may also be None: no limit.

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
