"""Every track of a recording, read back to the resolution of each item (docs/howto/asterix.md)."""

import sys
from pathlib import Path

import pytest

from multiradar.tracking.settings import TrackingSettings
from support.scenarios.live_scene import recording, sensors
from validation.asterix import check_asterix_output as check

#: Six minutes: tracks begin, become confirmed, coast and end, and biases settle.
ROWS = 4000


@pytest.fixture(scope="module")
def reported(tmp_path_factory: pytest.TempPathFactory) -> tuple[check.RecordingChannel, Path]:
    """System tracks sent to a user for a recording, and the file with them."""
    folder = tmp_path_factory.mktemp("output")
    frame = recording(ROWS, step_s=0.09)
    # An aircraft without plots after three minutes, and one detected by a single radar.
    time_s = frame["time_s"] - frame["time_s"].min()
    gone = (frame["track_number"] == 3) & (time_s > 180.0)
    alone = (frame["track_number"] == 4) & (frame["sensor_id"] != "41-10")
    frame.filter(~(gone | alone)).write_parquet(folder / "measurements.parquet")
    path = folder / "tracks.ast"
    settings = TrackingSettings(filter_name="imm")
    return check.written(folder, sensors(), settings, path), path


def test_our_reader_reads_every_field_to_its_resolution(
    reported: tuple[check.RecordingChannel, Path],
) -> None:
    user, path = reported
    found = check.compared(user, check.own_records(path))
    assert {name: worst for name, (_, worst) in found.items() if worst > check.ROUNDING} == {}
    said = set(found)
    assert {"062/105/LAT", "062/185/VX", "062/136", "062/340/POS/RHO", "062/500/APW/LAT",
            "062/290/ES", "062/100/X", "063/080/SRB", "063/081"} <= said  # fmt: skip
    # Tracks that began, ended, and were seen by one radar alone are among them.
    assert any(one.last.any() for one in user.track_reports)
    assert any(one.monosensor.any() for one in user.track_reports)


def test_libasterix_reads_every_field_to_its_resolution(
    reported: tuple[check.RecordingChannel, Path],
) -> None:
    pytest.importorskip("asterix.base", reason="libasterix is not installed")
    user, path = reported
    found = check.compared(user, check.peer_records(path, sys.executable))
    assert {name: worst for name, (_, worst) in found.items() if worst > check.ROUNDING} == {}
