"""System track reports for tests: all equal except for the given columns."""

from dataclasses import replace
from typing import Any

import numpy as np

from multiradar_converters.asterix.layout.catalogue import layout_of
from multiradar_converters.asterix.layout.fields import record_fields
from multiradar_converters.asterix.layout.program import program_of, walk
from multiradar_converters.asterix.writing.encoding import Records, Written
from multiradar_converters.asterix.writing.senders import Sender
from multiradar_converters.asterix.writing.track_reports import TrackReports

SENDER = Sender(20, 250, 7)


def reports(count: int = 1, **columns: Any) -> TrackReports:
    """Tracks over (50° N, 15° E) at 08:00, detected by a radar, with all fields known."""

    def numbers(value: float) -> Any:
        return np.full(count, value)

    def flags(value: bool) -> Any:
        return np.full(count, value, np.bool_)

    def whole(value: int) -> Any:
        return np.full(count, value, np.int64)

    reports = TrackReports(
        time_s=28_800.0,
        number=np.arange(count, dtype=np.int64),
        latitude_deg=numbers(50.0),
        longitude_deg=numbers(15.0),
        x_m=numbers(np.nan),
        y_m=numbers(np.nan),
        velocity_east_mps=numbers(200.0),
        velocity_north_mps=numbers(-100.0),
        mode_3a=whole(0o1234),
        mode_s_address=whole(0x4B1234),
        callsign=whole(-1),
        code_changed=flags(False),
        measured_height_m=numbers(350 * 30.48),
        barometric_m=numbers(350 * 30.48),
        geometric_m=numbers(np.nan),
        climb_mps=numbers(0.0),
        turning=whole(3),
        speeding=whole(3),
        climbing=whole(0),
        monosensor=flags(False),
        tentative=flags(False),
        first=flags(False),
        last=flags(False),
        implausible=flags(False),
        coasting=flags(False),
        on_ground=flags(False),
        track_age_s=numbers(10.0),
        age_s=np.tile([np.nan, 1.0, 2.0, np.nan, np.nan], (count, 1)),
        height_age_s=numbers(2.0),
        code_age_s=numbers(2.5),
        old_s=20.0,
        sensor=whole(20 << 8 | 130),
        range_m=numbers(50 * 1852.0),
        azimuth_deg=numbers(90.0),
        plot_height_m=numbers(350 * 30.48),
        plot_mode_3a=whole(0o1234),
        plot_type=whole(5),
        variance_east_m2=numbers(900.0),
        variance_north_m2=numbers(400.0),
        covariance_m2=numbers(0.0),
        variance_x_m2=numbers(np.nan),
        variance_y_m2=numbers(np.nan),
        covariance_xy_m2=numbers(np.nan),
        velocity_sigma_mps=numbers(3.0),
        height_sigma_m=numbers(30.48),
    )
    return replace(reports, **{name: _column(value, count) for name, value in columns.items()})


def read(category: int, edition: str, written: Written) -> list[dict[str, Any]]:
    """Read records field by field."""
    program = program_of(layout_of(category, edition))
    begins, ends = np.array([0]), np.array([len(written.data)])
    walked = walk(program, written.data, begins, ends)
    assert not walked.faults[0, 0]
    assert walked.records[:, 2].tolist() == written.ends.tolist()
    return [record_fields(program, written.data, starts) for starts in walked.starts]


def read_tracks(records: Records) -> list[dict[str, Any]]:
    """Read records of category 062."""
    return read(62, "1.21", records.written())


def _column(value: Any, count: int) -> Any:
    if isinstance(value, bool):
        return np.full(count, value, np.bool_)
    if isinstance(value, float | int):
        return np.full(count, value)
    return value if isinstance(value, np.ndarray) else np.array(value)
