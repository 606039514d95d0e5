"""`multiradar convert asterix` reports clock offset and latency from times of reception."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from multiradar.cli.main import EXIT_DONE, run
from support.asterix.octets import (
    block,
    datagram,
    final_format,
    gps,
    north_mark,
    pcap,
    plot_001,
    plot_048,
)

START_S = 43_200.0
UNIX_S = 1_533_081_600.0


def captured(messages: list[tuple[float, bytes]]) -> bytes:
    """Write a capture on some day."""
    return pcap((UNIX_S + seconds, datagram(one)) for seconds, one in messages)


Message = tuple[float, bytes]
FORMS: dict[str, Callable[[list[Message]], bytes]] = {
    "gps": gps,
    "final": lambda messages: final_format(messages),
    "capture": captured,
}


def figures(folder: Path, content: bytes) -> dict[str, Any]:
    """Convert a recording; return the figures of its report."""
    path, out = folder / "recording", folder / "out"
    path.write_bytes(content)
    assert run(["convert", "asterix", str(path), "--out", str(out)]) == EXIT_DONE
    found: dict[str, Any] = json.loads((out / "report.json").read_bytes())["figures"]
    return found


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("truncated", [False, True])
def test_a_radar_whose_clock_is_off_raises_an_alarm(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], form: str, *, truncated: bool
) -> None:
    messages: list[Message] = []
    for k in range(40):
        now_s = START_S + 4.0 * k
        shown_s = now_s + 60.0
        messages.append((now_s + 0.02, north_mark(shown_s)))
        plot = block(1, plot_001(shown_s)) if truncated else block(48, plot_048(shown_s))
        messages.append((now_s + 0.25, plot))
        messages.append((now_s + 0.5, block(48, plot_048(now_s, source="14 83"))))
    found = figures(tmp_path, FORMS[form](messages))
    wrong, right = found["clocks"]["20-130"], found["clocks"]["20-131"]
    assert wrong["messages"] == 80
    assert wrong["clock_offset_s"] == pytest.approx(59.98, abs=0.011)
    assert wrong["latency_median_s"] == pytest.approx(-59.75, abs=0.011)
    assert right["clock_offset_s"] == pytest.approx(-0.5, abs=0.011)
    assert [(one["sensor_id"], one["alarm"]) for one in found["sensor_alarms"]] == [
        ("20-130", "clock")
    ]
    output = capsys.readouterr()
    assert "20-130: time stamps are at least 59.98 s ahead of reception" in output.err
    assert "20-131" not in output.err
    assert "for 2 sensors; see report.json for each sensor" in output.out


def test_a_recorder_in_local_time_is_named_and_raises_no_alarm(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    messages = [
        (START_S + 7200.2 + k, block(48, plot_048(START_S + k, source=source)))
        for k in range(20)
        for source in ("14 82", "14 83")
    ]
    found = figures(tmp_path, gps(messages))
    assert (found["receiver_zone_s"], found["sensor_alarms"]) == (7200.0, [])
    output = capsys.readouterr()
    assert "reception times are probably in local time, UTC +2 h" in output.out
    assert "ahead" not in output.err


def test_a_recording_without_times_of_reception_reports_no_clocks(tmp_path: Path) -> None:
    found = figures(tmp_path, block(48, plot_048(START_S)) * 20)
    assert (found["clocks"], found["receiver_zone_s"], found["sensor_alarms"]) == ({}, 0.0, [])
