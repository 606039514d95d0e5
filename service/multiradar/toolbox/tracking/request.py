"""The options of `track`, checked, and the settings made of them."""

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict

from multiradar.toolbox.arguments import unknown_argument
from multiradar.toolbox.inputs import parse_day
from multiradar.toolbox.output import PathLike
from multiradar.toolbox.settings import (
    check_count,
    checked_fields,
    checked_kinds,
    require,
    settings_of,
    within,
)

if TYPE_CHECKING:
    from multiradar.runtime.queries.encounter_query import EncounterQuery
    from multiradar.settings.service import Settings


class TrackOptions(TypedDict, total=False):
    """Further options of `track`; None means the default.

    date, profile, allow_missing
        Of a dump that is converted on the fly: date of its first line, layout, and whether it may
        lack tracks.txt or plots_ads.txt.
    epoch_s, reorder_horizon_s : float
        Bias update interval, and reordering window, s of data time.
    acceleration_density, motion
        Process noise of `two-stage` and others: m²/s³; white-acceleration or velocity-frame.
    workers, batch : int
        Threads, or Ray actors, and rows at a time; the output depends on neither.
    engine, cluster_listen : str, collection of str
        threads (the default) or ray, and the addresses on which Ray may listen: see
        docs/howto/cluster.md.
    manoeuvre_planes, observability : float
        Window of these tables, s.
    encounters : float
        Horizon of the table of encounters, s; encounter_distance_m and encounter_height_m are its
        thresholds.
    trajectories : bool
        Write reconstructed trajectories, of trajectory_aircraft_max tracks at a time.
    forecasts : float
        Interval of the table of forecasts, s.
    biases_from : path
        Start from the biases at the end of this run, with their covariance, in place of priors.
    reference, processor : path, str
        System tracks of another processor as a bias reference, and its SAC-SIC.
    asterix, report : path
        Also write system tracks in ASTERIX, and an HTML page.
    config : path
        Settings in TOML; arguments and the environment take precedence.
    """

    date: str | None
    profile: PathLike | None
    allow_missing: bool
    epoch_s: float | None
    reorder_horizon_s: float | None
    acceleration_density: float | None
    motion: str | None
    workers: int | None
    engine: str | None
    cluster_listen: Collection[str] | None
    batch: int
    manoeuvre_planes: float | None
    observability: float | None
    encounters: float | None
    encounter_distance_m: float | None
    encounter_height_m: float | None
    trajectories: bool
    trajectory_aircraft_max: int | None
    forecasts: float | None
    biases_from: PathLike | None
    reference: PathLike | None
    processor: str | None
    asterix: PathLike | None
    report: PathLike | None
    config: PathLike | None


@dataclass(frozen=True, slots=True)
class TrackRequest:
    """The arguments of `track`, checked.

    Attributes
    ----------
    settings : Settings
        Made of the arguments, the environment and the file of settings.
    kinds : frozenset of str, optional
        Kinds of measurement to use; all by default.
    encounters : EncounterQuery, optional
        Encounters to write; none by default.
    options : TrackOptions
        The other arguments.
    """

    settings: "Settings"
    kinds: frozenset[str] | None
    encounters: "EncounterQuery | None"
    options: TrackOptions

    def path(self, name: str) -> Path | None:
        """Return an argument that is a path; None if it is not given."""
        given = self.options.get(name)
        return None if given is None else Path(str(given))

    def outputs(self) -> dict[str, object]:
        """Return the further tables by the option of the command; None: not wanted."""
        names = ("encounters", "forecasts", "trajectories", "manoeuvre_planes", "observability")
        return {f"--{name.replace('_', '-')}": self.options.get(name) or None for name in names}


def track_request(
    host: str | None,
    kinds: Collection[str] | None,
    hide: Collection[str] | None,
    options: TrackOptions,
) -> TrackRequest:
    """Check the arguments of `track`.

    Parameters
    ----------
    host : str, optional
        Name of the filter; that of a registered one is not known here.
    kinds, hide : collection of str, optional
        Kinds of measurement to use, and fields to withhold.
    options : TrackOptions
        The others.

    Raises
    ------
    ArgumentError
        One cannot be used.
    ConfigurationError
        A setting of the file or the environment cannot be used.
    """
    from multiradar.runtime.queries.parameters import WINDOW

    for name in options:
        if name not in TrackOptions.__annotations__:
            raise unknown_argument(name, TrackOptions.__annotations__)
    parse_day(options.get("date"), warned=False)
    for name in ("workers", "batch"):
        check_count(name, options.get(name))
    if not options.get("trajectories"):
        require("trajectories", {"trajectory_aircraft_max": options.get("trajectory_aircraft_max")})
    if options.get("reference") is None:
        require("reference", {"processor": options.get("processor")})
    for name in ("manoeuvre_planes", "observability"):
        within(name, options.get(name), WINDOW)  # type: ignore[arg-type]  # numbers
    settings = {
        "filter_name": host,
        "hidden_fields": checked_fields(hide),
        **{
            name: options.get(name)
            for name in ("epoch_s", "reorder_horizon_s", "acceleration_density", "motion")
        },
    }
    return TrackRequest(
        settings_of(options.get("config"), settings, _cluster(options)),
        checked_kinds(kinds),
        _encounters(options),
        options,
    )


def _cluster(options: TrackOptions) -> dict[str, object]:
    engine, listen = options.get("engine"), options.get("cluster_listen")
    given: dict[str, object] = {} if engine is None else {"engine": engine}
    return given if listen is None else {**given, "cluster": {"listen": tuple(listen)}}


def _encounters(options: TrackOptions) -> "EncounterQuery | None":
    from multiradar.runtime.queries.encounter_query import EncounterQuery
    from multiradar.runtime.queries.parameters import (
        ENCOUNTER_DISTANCE,
        ENCOUNTER_DISTANCE_M,
        ENCOUNTER_HEIGHT,
        ENCOUNTER_HORIZON,
    )

    horizon_s = within("encounters", options.get("encounters"), ENCOUNTER_HORIZON)
    distance_m, height_m = (
        options.get("encounter_distance_m"),
        options.get("encounter_height_m"),
    )
    within("encounter_distance_m", distance_m, ENCOUNTER_DISTANCE)
    within("encounter_height_m", height_m, ENCOUNTER_HEIGHT)
    if horizon_s is None:
        given = {"encounter_distance_m": distance_m, "encounter_height_m": height_m}
        require("encounters", given)
        return None
    near_m = ENCOUNTER_DISTANCE_M if distance_m is None else distance_m
    return EncounterQuery(horizon_s, near_m, height_m, limit=None)
