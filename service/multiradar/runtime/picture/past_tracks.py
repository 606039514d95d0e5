"""The list of tracks at a past time."""

import polars as pl

from multiradar.errors import RequestError
from multiradar.tracking.outputs import STATE_COASTING, STATE_CONFIRMED, STATE_NAMES


def past_tracks(rows: pl.DataFrame, at_s: float, coast_after_s: float) -> pl.DataFrame:
    """Return the tracks of a past time as the service lists the present ones.

    Parameters
    ----------
    rows : DataFrame
        The last update of each track, rows of `tracks.parquet`.
    at_s : float
        The time, s.
    coast_after_s : float
        Age from which a confirmed track is coasting, s.

    Returns
    -------
    DataFrame
        As `Knowledge.tracks`, with the age at that time; the age by reception is not retained.
    """
    age_s = at_s - pl.col("time_s")
    coasting = (pl.col("state") == STATE_NAMES[STATE_CONFIRMED]) & (age_s > coast_after_s)
    state = pl.when(coasting).then(pl.lit(STATE_NAMES[STATE_COASTING])).otherwise(pl.col("state"))
    return rows.sort("track_id").with_columns(
        state.cast(rows.schema["state"]).alias("state"),
        age_s.alias("age_s"),
        pl.lit(None, pl.Float64).alias("reception_age_s"),
    )


def not_retained(at_s: float, span_s: tuple[float, float] | None) -> RequestError:
    """Return the error of a request for a time that is not retained."""
    span = "nothing is retained" if span_s is None else (
        f"only data times {span_s[0]:.3f} to {span_s[1]:.3f} are retained"
    )  # fmt: skip
    return RequestError(404, "NOT_RETAINED", f"no tracks at data time {at_s:.3f}: {span}")
