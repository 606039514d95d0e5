"""The table of radar health, and alarms with their time."""

import io
import re

import pytest
from pydantic import JsonValue
from rich.console import Console

from multiradar.cli.terminal.health_table import print_health
from multiradar_schemas.report import Counts, Report


def _table_text(time_s: float) -> str:
    row: dict[str, JsonValue] = {
        "detection_probability": 0.9624292428553796, "range_sigma_ratio": 1.1841496496060946,
        "azimuth_sigma_ratio": 1234567.0, "silence_s": None, "alarms": "silence,noise",
    }  # fmt: skip
    report = Report(
        command="track", version="1", counts=Counts(read=0, accepted=0, rejected=0),
        rejected_by_code={}, inputs=[], outputs=[],
        figures={
            "sensor_health": {"26-10": row},
            "sensor_alarms": [{"time_s": time_s, "sensor_id": "26-10", "alarm": "silence"}],
        },
    )  # fmt: skip
    console = Console(file=io.StringIO(), width=120, highlight=False)
    print_health(report, console)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


@pytest.mark.parametrize(
    ("time_s", "text"), [(1533111151.3, "2018-08-01 08:12:31 UTC"), (29551.3, "08:12:31")]
)
def test_an_alarm_has_its_time_in_utc_where_the_date_is_known(time_s: float, text: str) -> None:
    assert f"alarm: 26-10: silence at {text}\n" in _table_text(time_s)


def test_a_row_shows_detection_noise_and_silence() -> None:
    line = next(line for line in _table_text(0.0).splitlines() if line.startswith("│ 26-10"))
    cells = [cell.strip() for cell in re.split("│", line)[1:-1]]
    expected = ["26-10", "0.962", "1.18 × nominal", "1234567.00 × nominal", "-", "silence, noise"]
    assert cells == expected
