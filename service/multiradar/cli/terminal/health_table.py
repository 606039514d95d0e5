"""The health of the radars as `track` prints it."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import JsonValue
    from rich.console import Console

    from multiradar_schemas.report import Report


def print_health(report: "Report", console: "Console") -> None:
    """Print the last row of each radar, and the alarms in the order in which they were raised.

    Parameters
    ----------
    report : Report
        Of `track`.
    console : Console
        Where to print.
    """
    from rich.table import Table

    health, alarms = report.figures["sensor_health"], report.figures["sensor_alarms"]
    assert isinstance(health, dict)
    assert isinstance(alarms, list)
    from multiradar.report.times import time_text

    table = Table(title="Final radar health", title_justify="left")
    table.add_column("sensor")
    for column in ("Pd", "range noise", "azimuth noise", "time since last plot"):
        table.add_column(column, justify="right")
    table.add_column("alarms")
    for sensor, row in health.items():
        assert isinstance(row, dict)
        table.add_row(
            sensor,
            _shown(row["detection_probability"], ".3f"),
            _shown(row["range_sigma_ratio"], ".2f", " × nominal"),
            _shown(row["azimuth_sigma_ratio"], ".2f", " × nominal"),
            _shown(row["silence_s"], ".1f", " s"),
            str(row["alarms"]).replace(",", ", "),
        )
    if health:
        console.print(table)
    for one in alarms:
        assert isinstance(one, dict)
        console.print(f"alarm: {one['sensor_id']}: {one['alarm']} at {time_text(_time_s(one))}")


def _time_s(alarm: "dict[str, JsonValue]") -> float:
    time_s = alarm["time_s"]
    assert isinstance(time_s, float)
    return time_s


def _shown(value: object, form: str, unit: str = "") -> str:
    return f"{value:{form}}{unit}" if isinstance(value, float) else "-"
