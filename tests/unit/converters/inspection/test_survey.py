"""Figures of recordings, from octets and lines written here."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from multiradar_converters.aircraft_data.quantities import without
from multiradar_converters.asterix.decoding import aircraft_items
from multiradar_converters.asterix.decoding.editions import Editions, sources_of
from multiradar_converters.asterix.decoding.gathering import decode_blocks
from multiradar_converters.asterix.framing.containers import read_blocks
from multiradar_converters.asterix.framing.windows import block_windows
from multiradar_converters.errors import LayoutError
from multiradar_converters.inspection import asterix_input
from multiradar_converters.inspection.document import inspection_of, stated_sites
from multiradar_converters.inspection.recordings import (
    InspectionOptions,
    inspect,
    recording_kind,
)
from multiradar_converters.inspection.reports import Reports
from multiradar_converters.inspection.sampling import SAMPLE_MAX, Sample
from multiradar_converters.inspection.sensor_figures import SensorFigures
from multiradar_converters.inspection.survey import Antenna, Survey
from multiradar_schemas.inspection import InspectedSite
from support.aircraft.registers import item_250, write
from support.asterix.octets import block, datagram, north_mark, pcap, plot_001, plot_048, record
from support.paths import ROOT

MILE_M = 1852.0
BEGIN_S = 28_800.0
DAY_S = 86_400.0
RADAR = ("20-130", "radar")


def surveyed(*paths: Path) -> Survey:
    return inspect(paths, InspectionOptions(), lambda _: None)


def of_octets(tmp_path: Path, content: bytes) -> Survey:
    path = tmp_path / "recording"
    path.write_bytes(content)
    return surveyed(path)


def reports(count: int, *, address: int = 1, spacing_s: float = 4.0) -> Reports:
    nothing = np.full(count, np.nan)
    return Reports(
        time_s=np.linspace(BEGIN_S, BEGIN_S + spacing_s * (count - 1), count),
        range_m=np.full(count, 50_000.0),
        azimuth_deg=np.linspace(0.0, 359.0, count),
        latitude_deg=nothing,
        longitude_deg=nothing,
        height_m=np.full(count, 9_000.0),
        code=np.full(count, 0o1000),
        address=np.full(count, address),
        on_ground=np.zeros(count, dtype=np.bool_),
        aircraft_data=without(count),
        dropped=np.zeros(count, dtype=np.int64),
    )


def test_aircraft_derived_data_have_counts_noise_and_reasons(tmp_path: Path) -> None:
    plots = [
        plot_048(
            BEGIN_S + 4.0 * k,
            registers=item_250(
                bds40=write("4,0", panel_altitude=36_000.0),
                bds60=write("6,0", magnetic_heading=90.0 + 0.6 * (-1) ** k, mach=0.8)
                | ((k == 5) << 36),
            ),
        )
        for k in range(60)
    ]
    survey = of_octets(tmp_path, b"".join(block(48, one) for one in plots))
    figures = survey.sensors[RADAR].data
    assert (figures.reports, figures.with_data) == (60, 60)
    assert dict(figures.dropped) == {"unannounced_bits": 1}
    found = inspection_of(survey, {}).sensors[0].aircraft_data
    assert found is not None
    assert {name: one.reports for name, one in found.values.items()} == {
        "magnetic_heading_deg": 59, "mach": 59, "selected_altitude_m": 60,
    }  # fmt: skip
    # Alternating by six steps of the register.
    noise = found.values["magnetic_heading_deg"].sigma
    assert noise == pytest.approx(1.4826 * 6 * 90 / 512 / 1.5**0.5, rel=0.01)


def test_plots_are_counted_by_sensor(tmp_path: Path) -> None:
    plots = [plot_048(BEGIN_S + 4.0 * k, range_nm=20.0 + k, azimuth_deg=35.0) for k in range(10)]
    survey = of_octets(tmp_path, b"".join(block(48, one) for one in plots))
    figures = survey.sensors[RADAR]
    assert (figures.reports, figures.measurements) == (10, 10)
    assert (figures.with_address, len(figures.addresses)) == (10, 1)
    assert (figures.first_s, figures.last_s) == (BEGIN_S, BEGIN_S + 36.0)
    assert figures.range_min_m == pytest.approx(20.0 * MILE_M)
    assert figures.range_max_m == pytest.approx(29.0 * MILE_M)
    assert np.flatnonzero(figures.sectors.any(axis=1)).tolist() == [3]
    assert survey.categories[48, "20-130"].records == 10
    assert (survey.files[0].read, survey.files[0].rejected) == (10, 0)


def test_reports_without_position_are_not_located(tmp_path: Path) -> None:
    # Items 010, 140 and 020 alone.
    bare = record((1, "14 82"), (2, f"{round(BEGIN_S * 128):06x}"), (3, "40"))
    survey = of_octets(tmp_path, block(48, bare) + block(48, plot_048(BEGIN_S)))
    found = inspection_of(survey, {})
    assert found.sampled_fraction == 1.0
    (sensor,) = found.sensors
    assert (sensor.reports, sensor.measurements, sensor.located_fraction) == (2, 1, 0.5)
    assert sensor.left_out == {"no_position": 1}


def test_equal_records_within_a_second_are_duplicates(tmp_path: Path) -> None:
    plot = block(48, plot_048(BEGIN_S))
    survey = of_octets(tmp_path, plot + plot + block(48, plot_048(BEGIN_S + 4.0)))
    assert survey.files[0].duplicates == survey.sensors[RADAR].duplicates == 1
    assert survey.sensors[RADAR].measurements == 2


def test_broken_octets_have_a_reason(tmp_path: Path) -> None:
    plots = [block(48, plot_048(BEGIN_S + k)) for k in range(10)]
    survey = of_octets(tmp_path, b"".join(plots) + bytes(40))
    account = survey.files[0]
    assert account.octets["quarantined"] == 40
    assert sum(account.reasons.values()) == account.rejected == 1
    assert account.read == 11


def test_north_marks_and_truncated_times(tmp_path: Path) -> None:
    turns = [
        north_mark(BEGIN_S + 4.0 * k) + block(1, plot_001(BEGIN_S + 4.0 * k + 1.0))
        for k in range(20)
    ]
    survey = of_octets(tmp_path, b"".join(turns))
    assert survey.antennas["20-130"].period_s == pytest.approx(4.0)
    assert survey.antennas["20-130"].north_marks == 20
    assert survey.sensors[RADAR].first_s == BEGIN_S + 1.0


def test_sites_are_those_that_radars_state() -> None:
    survey = Survey(
        antennas={
            "20-130": Antenna(9, 0, 4.0, (47.0, 8.0, 300.0)),
            "20-131": Antenna(9, 0, 4.0, None),
        }
    )
    assert stated_sites(survey) == {
        "20-130": InspectedSite(
            latitude_deg=47.0, longitude_deg=8.0, height_m=300.0,
            source="item 034/120: accurate to about 10 m; height above mean sea level",
        )
    }  # fmt: skip


def test_times_continue_past_midnight(tmp_path: Path) -> None:
    times = (DAY_S - 8.0 + 4.0 * np.arange(6)) % DAY_S
    survey = of_octets(tmp_path, b"".join(block(48, plot_048(time)) for time in times.tolist()))
    assert survey.sensors[RADAR].first_s == DAY_S - 8.0
    assert survey.sensors[RADAR].last_s == DAY_S + 12.0


@pytest.mark.slow
@pytest.mark.parametrize(("phase_s", "days"), [(0.5, 0), (1.0, 1)])
def test_a_file_that_contradicts_the_previous_one_is_read_twice(
    phase_s: float, days: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    windows = partial(block_windows, octets=1 << 18)
    monkeypatch.setattr(asterix_input, "block_windows", windows)
    times = 4.0 * np.arange(20_000)
    paths = [tmp_path / "a.ast", tmp_path / "b.ast"]
    for path, first_s in zip(paths, (0.5, phase_s), strict=True):
        parts = (block(48, plot_048(time + first_s)) for time in times.tolist())
        path.write_bytes(b"".join(parts))
    assert len(list(windows(paths[1]))) > 1
    survey = surveyed(*paths)
    figures = survey.sensors[RADAR]
    assert (figures.reports, len(survey.order.moved)) == (40_000, days)
    assert (figures.first_s, figures.last_s) == (0.5, times[-1] + phase_s + days * DAY_S)


def test_the_clock_of_the_recorder_has_the_date(tmp_path: Path) -> None:
    start_s = 1_682_985_600.0
    packets = [
        (start_s + BEGIN_S + k + 0.3, datagram(block(48, plot_048(BEGIN_S + k)))) for k in range(9)
    ]
    assert of_octets(tmp_path, pcap(packets)).start_s == start_s


def test_registers_are_counted(tmp_path: Path) -> None:
    # Item 250: two registers of seven octets, each with its number.
    register = "02" + "00" * 7 + "40" + "00" * 7 + "60"
    plots = [
        record((1, "14 82"), (2, f"{round((BEGIN_S + k) * 128):06x}"), (3, "a0"),
               (4, "1900 4000"), (10, register))
        for k in range(5)
    ]  # fmt: skip
    survey = of_octets(tmp_path, b"".join(block(48, one) for one in plots))
    assert survey.sensors[RADAR].registers == {"any": 5, "4,0": 5, "6,0": 5}


def test_registers_of_windows_without_figures_are_not_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def not_wanted(*_: object) -> None:
        raise AssertionError

    content = b"".join(block(48, plot_048(BEGIN_S + k, registers="00")) for k in range(5))
    path = tmp_path / "recording"
    path.write_bytes(content)
    blocks = read_blocks(path)
    sources = sources_of(blocks)
    editions = Editions()
    editions.detect(blocks, sources)
    monkeypatch.setattr(aircraft_items, "read_registers", not_wanted)
    found = decode_blocks(blocks, sources, editions, with_aircraft_data=False)
    assert sum(len(targets.time_s) for _, _, targets in found.targets) == 5
    with pytest.raises(AssertionError):
        decode_blocks(blocks, sources, editions)


def test_a_dump_has_sensors_and_rejected_lines() -> None:
    survey = surveyed(ROOT / "examples" / "vid-sample")
    assert {name for name, _ in survey.sensors} == {"26-10", "35-10", "41-1", "41-10", "adsb"}
    assert sum(one.rejected for one in survey.files) == 30
    assert sum(one.read for one in survey.files) == 62_303


def test_trajectories(tmp_path: Path) -> None:
    path = tmp_path / "flights.json"
    rows = [
        {"timestamp": 1_533_101_250_000 + 1000 * k, "icao24": "3003ae", "latitude": 47.0 + k / 900,
         "longitude": 8.0, "altitude": 30_000}
        for k in range(20)
    ]  # fmt: skip
    path.write_text(json.dumps(rows), encoding="utf-8")
    figures = surveyed(path).sensors["adsb", "adsb"]
    assert (figures.reports, figures.measurements, len(figures.addresses)) == (20, 20, 1)


@pytest.mark.parametrize(
    ("content", "words"),
    [(b"", "empty"), (b"PAR1" + bytes(40), "already converted"), (b"\x1f\x8b\x08", "gzip")],
)
def test_what_is_no_recording(content: bytes, words: str, tmp_path: Path) -> None:
    with pytest.raises(LayoutError, match=words):
        of_octets(tmp_path, content)


def test_text_in_any_encoding_is_no_asterix(tmp_path: Path) -> None:
    path = tmp_path / "recording"
    text = set()
    for octet in range(256):
        path.write_bytes(b"a" + bytes([octet]))
        if recording_kind(path) == "adsb":
            text.add(octet)
    assert text == {*b"\t\n\r", *range(0x20, 0x7F), *range(0x80, 0x100)}


def test_gaps_are_longer_than_scans() -> None:
    figures = SensorFigures()
    times = np.concatenate([np.arange(0.0, 300.0, 4.0), np.arange(400.0, 700.0, 4.0)])
    figures.add_times(times)
    assert [(gap.first_s, gap.duration_s) for gap in figures.gaps(4.0)] == [(297.0, 103.0)]
    assert figures.gaps(60.0) == []


def test_the_sample_has_whole_tracks_of_the_same_aircraft() -> None:
    one, other = Sample(), Sample()
    for address in range(200):
        one.add(reports(400, address=address))
        other.add(reports(500, address=address))
    first, second = one.reports(), other.reports()
    assert SAMPLE_MAX // 8 < len(first) <= SAMPLE_MAX
    counts = np.unique(first.address, return_counts=True)[1]
    assert set(counts.tolist()) == {400}
    assert set(second.address.tolist()) <= set(first.address.tolist())


def test_the_sample_of_one_aircraft_is_thinned() -> None:
    sample = Sample()
    for _ in range(20):
        sample.add(reports(10_000))
    assert SAMPLE_MAX // 4 <= len(sample.reports()) <= SAMPLE_MAX
