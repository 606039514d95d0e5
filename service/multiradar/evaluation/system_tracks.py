"""System tracks of another processor: which updates of a track number belong to one flight."""

import numpy as np
import polars as pl

from multiradar.errors import InputError
from multiradar.evaluation.reference_rows import reachable
from multiradar.evaluation.trajectories import Flags, Indices
from multiradar.geodesy.wgs84 import enu_rotation

#: Processors drop a track after at most this time without plots, s; then its number is free.
SILENCE_S = 60.0


def of_one_processor(frame: pl.DataFrame, source: str, processor: str | None) -> pl.DataFrame:
    """Return the updates with a position of one processor.

    Parameters
    ----------
    frame : DataFrame
        `system_tracks.parquet`.
    source : str
        Name used in errors.
    processor : str, optional
        Its `sensor_id`; needed where there are several.

    Returns
    -------
    DataFrame
        Its rows that have a position.

    Raises
    ------
    InputError
        There is no such processor, or none or several with positions.
    """
    located = frame.drop_nulls(["latitude_deg", "longitude_deg"])
    if located.is_empty():
        msg = (
            f"{source}: none of {len(frame)} system track updates has a WGS 84 position (item "
            "062/105); Cartesian positions (062/100) are not used"
        )
        raise InputError(msg)
    known = located["sensor_id"].unique().sort().to_list()
    if processor is None and len(known) != 1:
        names = ", ".join(map(str, known))
        msg = (
            f"{source}: contains system tracks of several processors ({names}); select one with "
            "--processor"
        )
        raise InputError(msg)
    if processor is not None and processor not in known:
        msg = f"{source}: no system tracks of processor {processor}; known: {', '.join(known)}"
        raise InputError(msg)
    return located if processor is None else located.filter(pl.col("sensor_id") == processor)


def named_by_flight(frame: pl.DataFrame) -> pl.DataFrame:
    """Divide the updates of each track number into flights.

    A processor has a limited set of track numbers and uses the number of an ended track again for
    the next aircraft, often seconds later. A flight ends with an update of the state ``ended``,
    where the Mode S address changes and stays changed, or where the track comes back after a
    silence of more than `SILENCE_S` at a place that no aircraft flies to in that time.

    Parameters
    ----------
    frame : DataFrame
        `system_tracks.parquet` of one processor, in order of time.

    Returns
    -------
    DataFrame
        With `track_number` as text: the number, and from its second flight on the number of the
        flight, such as ``14/2``.
    """
    by_number = frame.with_row_index("_row").sort("track_number", "_row", nulls_last=True)
    begins = _ends_before(by_number) | _leaps(by_number)
    begins |= _changes_address(by_number, np.cumsum(begins | ~_same(by_number)))
    flight = pl.col("_begins").cum_sum().over("track_number") + 1
    number = pl.col("track_number").cast(pl.String)
    named = by_number.with_columns(pl.Series("_begins", begins, pl.Int64)).with_columns(
        pl.when(flight > 1)
        .then(pl.concat_str(number, flight.cast(pl.String), separator="/"))
        .otherwise(number)
        .alias("track_number")
    )
    return named.sort("_row").drop("_row", "_begins")


# Each function below returns by row whether a flight begins with it; rows are by number, then by
# time.
def _ends_before(frame: pl.DataFrame) -> Flags:
    ended = (frame["state"] == "ended").fill_null(value=False).to_numpy()
    return _from_second(ended[:-1] & ~ended[1:], frame) & _same(frame)


def _changes_address(frame: pl.DataFrame, flight: Indices) -> Flags:
    changed: Flags = np.zeros(len(frame), np.bool_)
    known = np.flatnonzero(frame["mode_s_address"].is_not_null().to_numpy())
    address, own = frame["mode_s_address"].gather(known).to_numpy(), flight[known]
    like_next = (own[1:] == own[:-1]) & (address[1:] == address[:-1])
    # An address received once is garbled.
    twice = np.flatnonzero(np.append(like_next, [False]) | np.append([False], like_next))
    twice = twice[twice < len(known)]
    known, address, own = known[twice], address[twice], own[twice]
    changed[known[1:][(own[1:] == own[:-1]) & (address[1:] != address[:-1])]] = True
    return changed


def _leaps(frame: pl.DataFrame) -> Flags:
    latitude, longitude, time_s = (
        frame[name].cast(pl.Float64).fill_null(np.nan).to_numpy()
        for name in ("latitude_deg", "longitude_deg", "time_s")
    )
    upright = enu_rotation(np.radians(latitude), np.radians(longitude))[:, 2]
    passed_s = np.diff(time_s)
    leap = (passed_s > SILENCE_S) & ~reachable(passed_s, upright[:-1], upright[1:])
    return _from_second(leap, frame) & _same(frame)


def _same(frame: pl.DataFrame) -> Flags:
    """Return by row whether the row before has the same number."""
    number = frame["track_number"].cast(pl.Int64).fill_null(-1).to_numpy()
    return _from_second(number[1:] == number[:-1], frame)


def _from_second(flags: Flags, frame: pl.DataFrame) -> Flags:
    return np.append(np.zeros(min(len(frame), 1), np.bool_), flags)
