"""Flight statuses, ground bits and flags of trajectories become the column `on_ground`."""

import json
from pathlib import Path
from typing import Any

import polars as pl

from multiradar.cli.main import EXIT_DONE, run
from support.asterix.octets import block, plot_048, record, time_of_day


def converted(tmp_path: Path, kind: str, content: bytes) -> tuple[pl.DataFrame, dict[str, Any]]:
    (tmp_path / "recording").write_bytes(content)
    out = tmp_path / "out"
    assert run(["convert", kind, str(tmp_path / "recording"), "--out", str(out)]) == EXIT_DONE
    figures: dict[str, Any] = json.loads((out / "report.json").read_text())["figures"]
    return pl.read_parquet(out / "measurements.parquet"), figures


def test_the_flight_status_is_the_ground_status(tmp_path: Path) -> None:
    plots = [plot_048(float(k), flight_status=k) for k in range(8)]
    table, figures = converted(tmp_path, "asterix", block(48, *plots))
    status = [False, True, False, True, None, None, None, None]
    assert table["on_ground"].to_list() == status
    assert table["flags"].to_list() == ["on_ground" if one else None for one in status]
    assert figures["flags"]["on_ground"] == 2


def test_a_ground_bit_that_is_not_set_counts_beside_an_address_only(tmp_path: Path) -> None:
    place, address, status = (4, "00800000 00100000"), (12, "3c660c"), (22, "24 a0")

    def report(seconds: float, bits: str, *items: tuple[int, str]) -> bytes:
        head = [(1, "0a0b"), (2, f"41 {bits}"), (3, time_of_day(seconds)), place]
        return record(*head, *items)

    parts = [
        report(1.0, "10", address),
        report(2.0, "00", address),
        report(3.0, "10"),
        report(4.0, "00"),
        report(5.0, "00", address, status),
    ]
    table, _ = converted(tmp_path, "asterix", block(20, *parts))
    assert table["on_ground"].to_list() == [True, False, True, None, True]


def test_a_flag_of_a_trajectory_is_true_false_or_missing(tmp_path: Path) -> None:
    reports = [
        {"timestamp": 1_533_110_400_000 + 1000 * k, "icao24": f"3c000{k}", "latitude": 47.0,
         "longitude": 8.5, "altitude": 1000.0, "onground": flag}
        for k, flag in enumerate([True, False, None])
    ]  # fmt: skip
    table, figures = converted(tmp_path, "adsb", json.dumps(reports).encode())
    assert table["on_ground"].to_list() == [True, False, None]
    assert figures["on_ground"] == 1
