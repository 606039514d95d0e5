"""The table of reports: what records keep of them, and the figures of what was written."""

from pathlib import Path

import numpy as np
import polars as pl

from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.table import quantities_of, records_of, write

#: Ground speed to airspeed, as reported: decimals of all that feeds send.
SPEEDS = (0.0, 0.0001, 123.4567, 250.1)


def test_decimals_of_aircraft_derived_data_are_kept(tmp_path: Path) -> None:
    count = len(SPEEDS)
    numbers = np.full((16, count), np.nan)
    numbers[roles.TIME] = 10.0 * np.arange(count)
    numbers[roles.LATITUDE], numbers[roles.LONGITUDE], numbers[roles.HEIGHT] = 46.0, 7.0, 9000.0
    numbers[roles.OF_AIRCRAFT[0]] = SPEEDS
    ground = np.array([1, 0, 0, -1])
    nothing = np.full(count, -1)
    words = np.array([0x4B1800 + np.arange(count), nothing, nothing, ground, np.zeros(count, int)])
    quantities = quantities_of(numbers)
    records = records_of(numbers, words)
    path = tmp_path / "measurements.parquet"
    written = write(path, iter([records]), 1_533_081_600.0, quantities)
    frame = pl.read_parquet(path)
    assert len(quantities) == 1
    assert frame[quantities.pop()].to_list() == [*SPEEDS]
    assert (written.rows, written.repeated, written.on_ground) == (count, 0, 1)
    assert written.addresses == {0x4B1800 + one for one in range(count)}
    assert frame["time_s"].to_list() == [1_533_081_600.0 + 10.0 * n for n in range(count)]
