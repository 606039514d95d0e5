"""Pages of tables, and opaque cursors to the next page."""

import base64
import binascii
import struct
from collections.abc import Callable

import polars as pl

from multiradar.access.parameters import parameter_error
from multiradar.errors import RequestError
from multiradar_schemas.measurements.measurement import TIME_MAX_S

#: Maximum rows in a page of a history.
HISTORY_ROWS_MAX = 5_000

_TRACK = struct.Struct("<cq")
_MOMENT = struct.Struct("<cdq")
# Maximum rows of the same time that a cursor skips.
_SKIPPED_MAX = 4_000


def track_cursor(track_id: int) -> str:
    """Return the cursor after a track in a list by ascending number."""
    return _encode(_TRACK.pack(b"t", track_id))


def read_track_cursor(cursor: str) -> int:
    """Return the number of the last track of the previous page.

    Raises
    ------
    RequestError
        422 when it is not a cursor of a list of tracks.
    """
    (track_id,) = _decode(cursor, _TRACK, b"t")
    return int(track_id)


def page_by_time(
    read: Callable[[float, int], pl.DataFrame], since: float | None, cursor: str | None, limit: int
) -> tuple[pl.DataFrame, str | None]:
    """Return a page of a table ordered by time, and the cursor of the next page.

    Parameters
    ----------
    read : callable
        Arguments: data time, s, and limit. Returns the rows from that time on, oldest first; fewer
        rows than the limit are the last ones.
    since : float or None
        Data time of the first page, s; None starts with the oldest row.
    cursor : str or None
        Cursor of the previous page, which overrides `since`.
    limit : int
        Maximum rows in the page.

    Raises
    ------
    RequestError
        422 when it is not a cursor of a table by time.
    """
    start_s, skipped = (-TIME_MAX_S if since is None else since, 0)
    if cursor is not None:
        start_s, skipped = _read_moment_cursor(cursor)
    rows = read(start_s, limit + skipped + 1).slice(skipped)
    page = rows.head(limit)
    if rows.height <= limit:
        return page, None
    last_s = page["time_s"][-1]
    given = int((page["time_s"] == last_s).sum()) + (skipped if last_s == start_s else 0)
    return page, _encode(_MOMENT.pack(b"m", last_s, given))


def page_until(
    read: Callable[[float | None, int, float], pl.DataFrame], since: float | None,
    cursor: str | None, limit: int, until: float,
) -> pl.DataFrame:  # fmt: skip
    """Return the last page of a table ordered by time, up to a time.

    Parameters
    ----------
    read : callable
        Arguments: data time or None, s, limit, and the second data time, s. Returns the last rows
        from the first time up to the second, oldest first.
    since : float or None
        Rows from this data time on; None: all.
    cursor : str or None
        Cursor of another page.
    limit : int
        Maximum rows in the page.
    until : float
        Data time of the last row.

    Raises
    ------
    RequestError
        422 with a cursor: there is no next page.
    """
    if cursor is not None:
        raise parameter_error({"cursor": "not allowed together with until"})
    return read(since, limit, until)


def _read_moment_cursor(cursor: str) -> tuple[float, int]:
    time_s, skipped = _decode(cursor, _MOMENT, b"m")
    if not (abs(time_s) < TIME_MAX_S and 0 <= skipped <= _SKIPPED_MAX):
        raise _wrong()
    return float(time_s), int(skipped)


def _encode(raw: bytes) -> str:
    return base64.urlsafe_b64encode(raw).rstrip(b"=").decode()


def _decode(cursor: str, form: struct.Struct, mark: bytes) -> tuple[float | int, ...]:
    try:
        raw = base64.urlsafe_b64decode(cursor + "=" * (-len(cursor) % 4))
        found, *values = form.unpack(raw)
    except (binascii.Error, struct.error, ValueError):
        raise _wrong() from None
    if found != mark:
        raise _wrong()
    return tuple(values)


def _wrong() -> RequestError:
    return parameter_error(
        {"cursor": "expected the `next_cursor` of the previous page"}, "CURSOR_INVALID"
    )
