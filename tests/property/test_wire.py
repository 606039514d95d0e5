"""A batch equals the table it came from, and every row is accepted or rejected."""

from typing import Any

import numpy as np
import polars as pl
from hypothesis import given, settings
from hypothesis import strategies as st

from multiradar.wire import measurement_batch, sensor_table
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from support.inputs.messages import adsb, radar, sensors

TABLE = sensor_table(sensors())
NUMBERS = ["time_s", "range_m", "azimuth_deg", "latitude_deg", "longitude_deg", "height_m"]
ODD = st.none() | st.floats()
ROWS = st.builds(
    lambda row, changes, sensor, code, number: {
        **row,
        **changes,
        "sensor_id": sensor,
        "mode_3a": code,
        "track_number": number,
    },
    st.sampled_from([radar(), adsb(), radar(kind="bearing"), adsb(kind="mlat"), radar(kind="x")]),
    st.dictionaries(st.sampled_from(NUMBERS), ODD, max_size=1),
    st.sampled_from(["41-10", "adsb", "finder", "unknown"]),
    st.none() | st.sampled_from(["0000", "7777", "7778"]),
    st.none() | st.integers(-1, 2**63 - 1),
)


@given(st.lists(ROWS, max_size=8))
def test_every_row_is_accepted_or_rejected_and_keeps_its_values(rows: list[dict[str, Any]]) -> None:
    frame = pl.DataFrame(rows, schema=MEASUREMENT_SCHEMA)
    batch, rejected = measurement_batch(frame, TABLE)
    kept = [row for number, row in enumerate(rows) if number not in set(rejected.index.tolist())]
    assert len(batch) + len(rejected) == len(rows)
    assert batch.time_s.tolist() == [row["time_s"] for row in kept]
    assert [TABLE.ids[number] for number in batch.sensor] == [row["sensor_id"] for row in kept]
    codes = [-1 if row["mode_3a"] is None else int(row["mode_3a"], 8) for row in kept]
    assert batch.mode_3a.tolist() == codes
    numbers = [-1 if row["track_number"] is None else row["track_number"] for row in kept]
    assert batch.track_number.tolist() == numbers
    radars = [row for row in kept if row["kind"] == "radar"]
    assert batch.range_m[batch.kind == 0].tolist() == [row["range_m"] for row in radars]
    np.testing.assert_allclose(
        np.degrees(batch.azimuth_rad[batch.kind == 0]), [row["azimuth_deg"] for row in radars]
    )


@settings(max_examples=50)
@given(st.lists(ROWS, max_size=8), st.integers(0, 8))
def test_the_way_a_table_is_cut_does_not_matter(rows: list[dict[str, Any]], cut: int) -> None:
    frame = pl.DataFrame(rows, schema=MEASUREMENT_SCHEMA)
    whole, rejected = measurement_batch(frame, TABLE)
    first, first_rejected = measurement_batch(frame[:cut], TABLE)
    second, second_rejected = measurement_batch(frame[cut:], TABLE)
    assert whole.time_s.tolist() == [*first.time_s.tolist(), *second.time_s.tolist()]
    assert rejected.reason == first_rejected.reason + second_rejected.reason
    moved = [*first_rejected.index.tolist(), *(second_rejected.index + len(frame[:cut])).tolist()]
    assert rejected.index.tolist() == moved
