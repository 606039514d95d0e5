"""The queries of the service, each declared once; HTTP, Zenoh and offline tables read them here.

A query is an entry of `QUERIES` with its parameters (`parameters`), its answer and its model.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import polars as pl
from pydantic import BaseModel

from multiradar.errors import PlaneError, TrajectoryError
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.queries import parameters
from multiradar.runtime.queries.encounters import answer_encounters
from multiradar.runtime.queries.forecasts import answer_forecast
from multiradar.runtime.queries.manoeuvre_planes import plane_of_track
from multiradar.runtime.queries.moment import Moment
from multiradar.runtime.queries.neighbouring_regions import answer_regions
from multiradar.runtime.queries.observabilities import observability_of_track
from multiradar.runtime.queries.parameters import Parameter
from multiradar.runtime.queries.track_windows import WindowAnalysis
from multiradar.runtime.queries.trajectory_sets import answer_trajectories
from multiradar.runtime.queries.used_plots import plots_of_track, residuals_of_radars
from multiradar_schemas.products.encounter import Encounters
from multiradar_schemas.products.forecast import Forecast
from multiradar_schemas.products.manoeuvre_plane import ManoeuvrePlane
from multiradar_schemas.products.observability import Observability
from multiradar_schemas.products.regions import Regions
from multiradar_schemas.products.residuals import Residuals
from multiradar_schemas.products.track_plots import TrackPlots
from multiradar_schemas.products.trajectories import Trajectories

Document = dict[str, Any]

#: Errors of a query that has no answer for its track; each has a `code`.
NO_ANSWER = (PlaneError, TrajectoryError)


@dataclass(frozen=True, slots=True)
class Query:
    """One query.

    Attributes
    ----------
    name : str
        The last part of its HTTP path.
    plural : str
        The part of its Zenoh key before the track.
    of_track : bool
        Whether it concerns one track; otherwise all.
    parameters : tuple of Parameter
        Its parameters.
    answer : callable
        Called with the data of a time, the track if `of_track`, and the values of all parameters.
        Returns the document, or None when there is no such live track. Raises one of `NO_ANSWER`,
        and ForecastError for inconsistent values.
    model : type
        Model of the document.
    summary : str
        One sentence for the documentation.
    no_answer : str
        Description of the conflict; empty if there is none.
    of_past : bool
        Whether it has answers for past times.
    """

    name: str
    plural: str
    of_track: bool
    parameters: tuple[Parameter, ...]
    answer: Callable[..., Document | None]
    model: type[BaseModel]
    summary: str
    no_answer: str = ""
    of_past: bool = True

    def ask(self, known: Moment, track_id: int | None, given: dict[str, Any]) -> Document | None:
        """Return the answer; absent parameters have their defaults.

        Raises
        ------
        ForecastError
            If a value is out of its bounds.
        PlaneError, TrajectoryError
            If the track has no such answer.
        """
        values = parameters.checked(self.parameters, given)
        if self.of_track:
            return self.answer(known, track_id, **values)
        return self.answer(known, **values)


def _of_window(analyse: WindowAnalysis) -> Callable[..., Document | None]:
    def answer(known: Moment, track_id: int, *, window_s: float) -> Document | None:
        window = known.window(track_id)
        if window is None:
            return None
        return analyse(window.rows, window_s, window.biases, known.sensors)

    return answer


FORECAST = Query(
    "forecast", "forecasts", True, parameters.FORECAST, answer_forecast, Forecast,
    "Predict the position of a track, with covariances and containment regions.",
    "The track has no state or bundle from which to predict; see `code`",
)  # fmt: skip
MANOEUVRE_PLANE = Query(
    "manoeuvre-plane", "manoeuvre-planes", True, (parameters.WINDOW,), _of_window(plane_of_track),
    ManoeuvrePlane,
    "Fit a plane to the last plots of a live track and test whether they lie in the plane.",
    "The plots in the window do not determine a plane; see `code`",
)  # fmt: skip
OBSERVABILITY = Query(
    "observability", "observability", True, (parameters.WINDOW,),
    _of_window(observability_of_track), Observability,
    "Return whether ranges or intersecting bearings make the position of a track observable.",
)  # fmt: skip
TRAJECTORIES = Query(
    "trajectories", "trajectories", True, parameters.TRAJECTORIES, answer_trajectories,
    Trajectories,
    "Return the reconstructed trajectories of a live track over its last 90 s, with weights.",
    "The track has no trajectories; see `code`",
    of_past=False,
)  # fmt: skip
ENCOUNTERS = Query(
    "encounters", "encounters", False, parameters.ENCOUNTERS, answer_encounters, Encounters,
    "Predict which pairs of tracks come close to each other, when, and with what probability.",
)  # fmt: skip
PLOTS = Query(
    "plots", "plots", True, (parameters.WINDOW,), plots_of_track, TrackPlots,
    "Return the last plots of a live track, corrected for biases, with innovations and weights.",
)  # fmt: skip
RESIDUALS = Query(
    "residuals", "residuals", False, (parameters.RESIDUAL_WINDOW,), residuals_of_radars, Residuals,
    "Return the innovations of the plots of all radars by range and by azimuth.",
)  # fmt: skip
REGIONS = Query(
    "regions", "regions", False, (), answer_regions, Regions,
    "Return the region of the service, its neighbours, and the biases that they handed over.",
    of_past=False,
)  # fmt: skip

QUERIES = (
    FORECAST, MANOEUVRE_PLANE, OBSERVABILITY, TRAJECTORIES, PLOTS, ENCOUNTERS, RESIDUALS, REGIONS,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class History:
    """A table by time of one track or sensor.

    Attributes
    ----------
    name : str
        The member of the answer with its rows.
    read : callable
        Called with the present data, the subject, a data time or None, a number of rows, and a
        second data time or None. Returns the first rows from the first time on, or the last, with
        the second time the last until then; fewer when there are no more.
    """

    name: str
    read: Callable[[Knowledge, Any, float | None, int, float | None], pl.DataFrame]


UPDATES = History("updates", Knowledge.history)
TRANSITIONS = History("transitions", Knowledge.transitions)
BIASES = History("biases", Knowledge.bias_history)
