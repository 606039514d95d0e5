"""The air picture at a past time, from what the service retains or from a recorded run."""

from typing import Any, NamedTuple, Protocol

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.memory.knowledge import AirTracks
from multiradar.runtime.memory.live_tracks import ages_and_states, sources_of
from multiradar.runtime.picture.bearing_lines import mark_tables, marks
from multiradar.runtime.picture.frames import encoded
from multiradar.runtime.picture.selection import WHOLE_MAX, WORLD, Area, at, shown
from multiradar.runtime.picture.track_columns import SOURCE_KEPT_S, track_columns
from multiradar.tracking.outputs import STATE_NAMES

#: Without an earlier frame: earlier positions and plots of so long before the time, s.
PATH_S = 120.0
#: A track that is not updated ends at the first processing after `drop_after_s`, s later at most.
ENDING_S = 10.0
PLOTS_S = 30.0
#: Plots of a frame, the latest: as many as a page shows.
PLOTS_MAX = 32_768
#: Interval of earlier positions of a track, s.
PATH_STEP_S = 5.0
#: With numbers up to so many times the rows a table of all numbers is faster than sorting.
_NUMBERS_PER_ROW = 64

Floats = NDArray[np.float64]


class PastAsked(NamedTuple):
    """What a page asks for.

    Attributes
    ----------
    at_s : float
        The time, s.
    since_s : float or None
        The time of its last frame: earlier positions and plots only since then.
    layer : int
        Number of the run.
    area, track : Area or None, int or None
        As in `Asked`.
    """

    at_s: float
    since_s: float | None = None
    layer: int = 0
    area: Area | None = None
    track: int | None = None


class Positions(NamedTuple):
    """Positions of updates by time; (n,) each."""

    track_id: NDArray[np.int64]
    time_s: Floats
    sensor: NDArray[np.int32]
    latitude_deg: Floats
    longitude_deg: Floats


class PictureSource(Protocol):
    """What a picture at a past time is made of; for any thread."""

    @property
    def sensors(self) -> SensorTable:
        """The sensors."""
        ...

    @property
    def coast_after_s(self) -> float:
        """Age from which a confirmed track is coasting, s."""
        ...

    @property
    def acceleration_density(self) -> float:
        """Spectral density of the acceleration between updates, m²/s³."""
        ...

    @property
    def has_plots(self) -> bool:
        """Whether it has plots, which name the sensors of a track."""
        ...

    def latest(self, at_s: float) -> NDArray[np.void]:
        """Return the last update of each track at a time, rows of `UPDATE_DTYPE` by track."""
        ...

    def spread(self, rows: NDArray[np.void]) -> tuple[SystemPlane | None, Floats]:
        """Return the covariances of rows of `latest` and their plane; None where not retained."""
        ...

    def positions(self, after_s: float, at_s: float) -> Positions:
        """Return the positions of the updates of a span."""
        ...

    def plots(self, after_s: float, at_s: float, limit: int) -> tuple[NDArray[np.void], int]:
        """Return the last plots of a span by time, rows of `PLOT_DTYPE`, and the rest's number."""
        ...

    def biases(self, at_s: float) -> Floats:
        """Return the biases estimated at a time, (sensors, parameters), m, rad, 1, s."""
        ...

    def bias_records(self, at_s: float) -> list[dict[str, Any]]:
        """Return the latest estimate of each bias at a time, rows of `biases.parquet`."""
        ...

    def health_records(self, at_s: float) -> list[dict[str, Any]]:
        """Return the health of the radars at a time, rows of `health.parquet`."""
        ...


class PastFiles(Protocol):
    """What is on disk of times that memory no longer has; for any thread."""

    @property
    def oldest_s(self) -> float | None:
        """The earliest time, s; None without any."""
        ...

    @property
    def written_s(self) -> float | None:
        """The time up to which they are written, s; None without any."""
        ...

    def at(self, at_s: float) -> "RecordedSource | None":
        """Return the data before a time; None if there are no tracks."""
        ...

    def rows(
        self,
        name: str,
        subject: int | str,
        since_s: float,
        before_s: float,
        limit: int,
        *,
        last: bool = False,
    ) -> pl.DataFrame:
        """Return the first or last rows of a track or a sensor in a span of time, oldest first.

        Parameters
        ----------
        name : str
            That of the table: `updates`, `transitions` or `biases`.
        subject : int or str
            The track or the sensor.
        since_s, before_s : float
            Rows not earlier than the first and earlier than the second.
        limit : int
            Maximum number of rows.
        last : bool
            Whether the last ones are returned, instead of the first.
        """
        ...


class RecordedSource(PictureSource, Protocol):
    """A source that has whole rows of tracks."""

    def tracks(self, at_s: float) -> pl.DataFrame:
        """Return the last update of each track at a time, rows of `tracks.parquet`."""
        ...


def past_frame(source: PictureSource, asked: PastAsked, members: dict[str, object]) -> bytes:
    """Return the picture at a past time.

    Parameters
    ----------
    source : PictureSource
        Where it is from.
    asked : PastAsked
        What the page asks for; at a time without data there are no tracks.
    members : dict
        Further members of the header.

    Returns
    -------
    bytes
        A frame as from `AirPicture.frame`, and with a table `path`: earlier positions of the
        tracks, one in `PATH_STEP_S`. A recorded run has no covariances. Of a source without plots
        there is a table `heard`: the time of the last update of each track by each sensor.
    """
    at_s, since_s = asked.at_s, asked.since_s
    if since_s is None or not at_s - PATH_S <= since_s <= at_s:
        since_s = at_s - PATH_S
    rows = source.latest(at_s)
    age_s, rows["state"] = ages_and_states(rows, at_s, source.coast_after_s)
    recent = source.positions(min(since_s, at_s - SOURCE_KEPT_S), at_s)
    heard_s = _heard(recent, rows["track_id"], source.sensors)
    plane, spread = source.spread(rows)
    air = AirTracks(0, at_s, rows, age_s, heard_s, spread)
    tracks = track_columns(air, plane, source.acceleration_density)
    total = len(rows)
    if total > WHOLE_MAX:
        tracks = at(tracks, shown(tracks, asked.area or WORLD, asked.track))
    plot_rows, skipped = source.plots(max(since_s, at_s - PLOTS_S), at_s, PLOTS_MAX)
    found = marks(plot_rows, source.biases(at_s), source.sensors)
    header = {
        "at_s": at_s,
        "data_time_s": at_s,
        "next": 0,
        "skipped": skipped,
        "total": total,
        "sensors": list(source.sensors.ids),
        "states": list(STATE_NAMES),
        **members,
    }
    path = path_columns(recent, since_s, tracks["track_id"])
    plots = mark_tables(found, asked.area if total > WHOLE_MAX else None)
    heard = {} if source.has_plots else {"heard": _heard_columns(recent, tracks["track_id"])}
    return encoded(header, {"tracks": tracks, **plots, "path": path, **heard})


def last_of_each(track_id: NDArray[np.int64]) -> NDArray[np.intp]:
    """Return the index of the last row of each track, by ascending track."""
    most = int(track_id.max(initial=0))
    if track_id.min(initial=0) >= 0 and most < _NUMBERS_PER_ROW * len(track_id):
        # Of several assignments to one place the last counts.
        last = np.full(most + 1, -1, np.intp)
        last[track_id] = np.arange(len(track_id))
        found: NDArray[np.intp] = last[last >= 0]
        return found
    _, backwards = np.unique(track_id[::-1], return_index=True)
    found = len(track_id) - 1 - backwards
    return found


# Time of the last update of each track by each source, as from `LiveTracks.heard`.
def _heard(recent: Positions, tracks: NDArray[np.int64], sensors: SensorTable) -> Floats:
    heard_s = np.full((len(tracks), 3), -np.inf)
    if len(tracks) and len(sensors):
        place = np.minimum(np.searchsorted(tracks, recent.track_id), len(tracks) - 1)
        own = (tracks[place] == recent.track_id) & (recent.sensor >= 0)
        source = sources_of(sensors)[recent.sensor[own]]
        # By ascending time: the last assignment counts.
        heard_s[place[own], source] = recent.time_s[own]
    return heard_s


def _heard_columns(recent: Positions, tracks: Floats) -> dict[str, NDArray[Any]]:
    kept = np.isin(recent.track_id, tracks) & (recent.sensor >= 0)
    number, sensor = recent.track_id[kept], recent.sensor[kept].astype(np.int64)
    rows = last_of_each(number * (int(sensor.max(initial=0)) + 1) + sensor)
    return {
        "track_id": number[rows].astype(np.float64),
        "sensor": sensor[rows].astype(np.int32),
        "time_s": recent.time_s[kept][rows],
    }


def path_columns(recent: Positions, since_s: float, tracks: Floats) -> dict[str, NDArray[Any]]:
    """Return earlier positions as the table `path`: of each track the last of each interval.

    Parameters
    ----------
    recent : Positions
        Positions of all tracks.
    since_s : float
        Only later ones.
    tracks : (n,) ndarray
        The tracks.
    """
    kept = np.isin(recent.track_id, tracks) & (recent.time_s > since_s)
    if not kept.any():
        return {}
    number, time_s = recent.track_id[kept], recent.time_s[kept]
    steps = np.floor(time_s / PATH_STEP_S).astype(np.int64)
    steps -= steps.min()
    rows = np.sort(last_of_each(number * (int(steps.max()) + 1) + steps))
    return {
        "track_id": number[rows].astype(np.float64),
        "time_s": time_s[rows],
        "latitude_deg": recent.latitude_deg[kept][rows],
        "longitude_deg": recent.longitude_deg[kept][rows],
    }
