"""Parameters of the queries, each declared once: name, bounds, default, meaning.

HTTP, Zenoh, the commands and the offline tables read them from here. Nothing heavy is imported, so
that the help of a command is fast.
"""

import math
from dataclasses import dataclass
from typing import Any

from multiradar.errors import ForecastError
from multiradar_schemas.documents.names import did_you_mean

FILTER = "filter"
BUNDLE = "bundle"
POLYNOMIAL = "polynomial"
BY_TIME, BY_PROBABILITY = "time", "probability"

#: Defaults used elsewhere as well.
HORIZON_DEFAULT_S, STEP_DEFAULT_S = 60.0, 5.0
PROBABILITY_DEFAULT = 0.95
WINDOW_DEFAULT_S = 60.0
PATH_POINTS_DEFAULT, PATH_STEP_DEFAULT_S = 120, 1
ENCOUNTER_HORIZON_S = 120.0
#: Five nautical miles: the separation en route.
ENCOUNTER_DISTANCE_M = 9260.0
ENCOUNTERS_DEFAULT = 100


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a query.

    Attributes
    ----------
    name : str
        Name, ending with the unit.
    default : float, int, str or None
        Value if absent; None: no effect. Its type is that of the parameter, `float` for None.
    description : str
        Description.
    least, most : float
        Bounds of a number.
    above : float, optional
        Exclusive lower bound, in place of `least`.
    choices : tuple of str
        Permitted values of a text.
    example : float, int or str, optional
        Example for the documentation.
    """

    name: str
    default: float | str | None
    description: str
    least: float = -math.inf
    most: float = math.inf
    above: float | None = None
    choices: tuple[str, ...] = ()
    example: float | str | None = None

    @property
    def kind(self) -> type:
        """Its type: float, int or str."""
        return float if self.default is None else type(self.default)

    def check(self, value: Any) -> None:
        """Check a value against the bounds or the choices.

        Raises
        ------
        ForecastError
            If it is out of bounds, or not a number.
        """
        if self.choices:
            if value not in self.choices:
                hint = did_you_mean(value, self.choices)
                *first, last = self.choices
                reason = f"expected {', '.join(first)} or {last}, was {value}{hint}"
                raise ForecastError(self.name, reason)
        # Written so that NaN fails.
        elif self.above is not None:
            if not self.above < value <= self.most:
                reason = f"expected more than {self.above:g} and at most {self.most:g}, was {value}"
                raise ForecastError(self.name, reason)
        elif not self.least <= value <= self.most:
            reason = f"expected {self.least:g} to {self.most:g}, was {value}"
            raise ForecastError(self.name, reason)


FORECAST_HORIZON = Parameter(
    "horizon_s", HORIZON_DEFAULT_S, "Prediction horizon, s", above=0.0, most=3600.0, example=120
)
FORECAST_STEP = Parameter(
    "step_s", STEP_DEFAULT_S, "Time between points, s", least=0.1, most=3600.0, example=10
)
#: Of the containment regions.
PROBABILITY = Parameter(
    "probability", PROBABILITY_DEFAULT, "Containment probability of the regions",
    least=0.01, most=0.999, example=0.95,
)  # fmt: skip
METHOD = Parameter("by", FILTER, "Prediction method", choices=(FILTER, BUNDLE, POLYNOMIAL))
FORECAST = (FORECAST_HORIZON, FORECAST_STEP, PROBABILITY, METHOD)

WINDOW = Parameter(
    "window_s", WINDOW_DEFAULT_S, "Length of the window of measurements, s",
    least=5.0, most=600.0, example=60,
)  # fmt: skip
RESIDUAL_WINDOW = Parameter(
    "window_s", 600.0, "Length of the window of plots before the data time, s",
    least=5.0, most=86_400.0, example=600,
)  # fmt: skip

PATH_POINTS = Parameter(
    "points",
    PATH_POINTS_DEFAULT,
    "Maximum number of points of each path; earlier points are omitted",
    least=0,
    most=600,
    example=30,
)
PATH_STEP = Parameter(
    "step_s",
    PATH_STEP_DEFAULT_S,
    "Time between the points of a path, whole seconds",
    least=1,
    most=60,
    example=5,
)
TRAJECTORIES = (PATH_POINTS, PATH_STEP)

ENCOUNTER_HORIZON = Parameter(
    "horizon_s", ENCOUNTER_HORIZON_S, "Prediction horizon, s", least=1.0, most=600.0, example=120
)
ENCOUNTER_DISTANCE = Parameter(
    "distance_m", ENCOUNTER_DISTANCE_M,
    "Horizontal threshold, m: include pairs whose predicted positions come closer",
    least=1.0, most=100_000.0, example=9260,
)  # fmt: skip
ENCOUNTER_HEIGHT = Parameter(
    "height_m", None,
    "Vertical threshold, m: skip pairs whose vertical separation is always larger; "
    "pairs with an unknown height are included",
    least=1.0, most=20_000.0, example=305,
)  # fmt: skip
ENCOUNTERS = (
    ENCOUNTER_HORIZON,
    ENCOUNTER_DISTANCE,
    ENCOUNTER_HEIGHT,
    Parameter(
        "probability_min", 0.0,
        "Minimum probability of coming within both thresholds; less probable pairs are skipped",
        least=0.0, most=1.0, example=0.1,
    ),
    Parameter(
        "order", BY_TIME, "Sort by time of closest approach, or by probability",
        choices=(BY_TIME, BY_PROBABILITY),
    ),
    Parameter(
        "limit", ENCOUNTERS_DEFAULT, "Maximum number of encounters",
        least=1, most=10_000, example=100,
    ),
)  # fmt: skip


def checked(parameters: tuple[Parameter, ...], given: dict[str, Any]) -> dict[str, Any]:
    """Return the values of all parameters: those given, and the defaults of the others.

    Raises
    ------
    ForecastError
        If a value is out of its bounds.
    """
    values = {one.name: given.get(one.name, one.default) for one in parameters}
    for one in parameters:
        if values[one.name] is not None:
            one.check(values[one.name])
    return values
