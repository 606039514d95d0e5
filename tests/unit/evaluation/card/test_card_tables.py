"""Tables of the scorecard."""

from multiradar.evaluation.card import tables
from multiradar.evaluation.card.figures import Figures


def test_a_difference_is_written_to_the_digits_of_its_sigma_or_of_its_spread() -> None:
    one: Figures = {
        "sensor_id": "20-130", "quantity": "range_m", "plots": 400, "aircraft": 7,
        "mean": 41.2345, "sigma": 2.345, "spread": 60.0, "estimate": 40.1234, "left": 1.1111,
    }  # fmt: skip
    # Of one aircraft, no sigma is known: a tenth of the spread stands for it.
    alone: Figures = {**one, "quantity": "azimuth_deg", "aircraft": 1, "sigma": None}
    assert tables._differences({"differences": [one, alone]}).rows == (
        ("20-130", "range, m", 400, 7, "41.2", "2.3", 60.0, "40.1", "1.1"),
        ("20-130", "azimuth, °", 400, 1, "41.2", None, 60.0, "40.1", "1.1"),
    )


def test_aircraft_without_compared_updates_come_first_and_then_the_worst() -> None:
    columns = (
        "tracks", "updates", "median_m", "p95_m", "along_rms_m", "across_rms_m", "delay_s",
        "longest_gap_s", "completeness",
    )  # fmt: skip
    errors_m = {"a": 50.0, "b": None, "c": 200.0, "d": 0.0}
    aircraft: list[Figures] = [
        {**dict.fromkeys(columns, 1.0), "aircraft": name, "rms_m": rms_m}
        for name, rms_m in errors_m.items()
    ]
    table = tables.aircraft_table({"aircraft": aircraft})
    assert [row[0] for row in table.rows] == ["b", "c", "a", "d"]
    assert table.title == "Aircraft"
    assert tables.aircraft_table({"aircraft": aircraft}, 4).title == "Aircraft"
    worst = tables.aircraft_table({"aircraft": aircraft}, 3)
    assert [row[0] for row in worst.rows] == ["b", "c", "a"]
    assert worst.title == "The 3 worst aircraft"
