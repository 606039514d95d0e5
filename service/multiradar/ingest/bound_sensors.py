"""Senders that may send measurements of some sensors only."""

import json
from collections.abc import Collection

import polars as pl

from multiradar.ingest.bodies import Decoded
from multiradar.runtime.live.receipt import RejectedRow
from multiradar_schemas.measurements.directions import without_empty_columns
from multiradar_schemas.measurements.gates import LISTED_ROWS_MAX
from multiradar_schemas.reject import RejectCode

_SENSOR = "sensor_id"
_INDEX = "index"


def of_allowed_sensors(decoded: Decoded, sensors: Collection[str] | None) -> Decoded:
    """Reject the rows of sensors that a sender may not send.

    Parameters
    ----------
    decoded : Decoded
        A message.
    sensors : collection of str, optional
        The sensors that it may send; None for all.

    Returns
    -------
    Decoded
        The same rows, those of other sensors rejected with `SENSOR_NOT_ALLOWED`.
    """
    frame = decoded.frame
    if sensors is None:
        return decoded
    few = len(frame) <= LISTED_ROWS_MAX
    if few and {*sensors, None}.issuperset(frame[_SENSOR].to_list()):
        return decoded
    # A row without a sensor is rejected as such later.
    foreign = ~pl.col(_SENSOR).is_in(list(sensors)) & pl.col(_SENSOR).is_not_null()
    others = frame.filter(foreign)
    if not len(others):
        return decoded
    expected = ", ".join(sorted(sensors)) or "none"
    content = without_empty_columns(others).drop(_INDEX).iter_rows(named=True)
    rejected = [
        RejectedRow(
            index,
            str(RejectCode.SENSOR_NOT_ALLOWED),
            f"sensor_id: expected a sensor allowed for this sender ({expected}), was {sensor}",
            json.dumps(raw, ensure_ascii=False),
        )
        for index, sensor, raw in zip(others[_INDEX], others[_SENSOR], content, strict=True)
    ]
    return Decoded(frame.filter(~foreign), (*decoded.rejected, *rejected))
