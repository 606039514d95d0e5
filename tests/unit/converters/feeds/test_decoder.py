"""Messages of feeds become reports, duplicates, rejects and others."""

import json
from typing import Any

import numpy as np
import pytest

from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.batches import Batch
from multiradar_converters.adsb.reading.splitting import RECORD_BYTES_MAX, Lines
from multiradar_converters.feeds.aircraft import AIRCRAFT_MAX, Aircraft
from multiradar_converters.feeds.decoder import FeedDecoder
from multiradar_schemas.reject import RejectCode
from support.scenarios.feeds import (
    BEGIN_S,
    aircraft,
    base_station,
    latitude,
    multilaterated,
    readsb_line,
    snapshot,
)

FOOT_M = 0.3048


def decoded(*messages: bytes, received_s: float | None = None, **options: Any) -> Batch:
    decoder = FeedDecoder(**options)
    for place, message in enumerate(messages, start=1):
        decoder.line(message, place, received_s)
    return counted(decoder.drain())


def counted(batch: Batch) -> Batch:
    count = batch.numbers.shape[1]
    assert batch.found == count + len(batch.rejected) + batch.duplicate
    return batch


def number(batch: Batch, role: int) -> float:
    return float(batch.numbers[role, -1])


def word(batch: Batch, role: int) -> int:
    return int(batch.words[role - roles.FIRST_WORD, -1])


def reasons(batch: Batch) -> list[tuple[RejectCode, str]]:
    return [(one.code, one.reason) for one in batch.rejected]


def callsign(batch: Batch) -> bytes:
    return word(batch, roles.CALLSIGN).to_bytes(8, "big").lstrip(b"\0")


# ---------------------------------------------------------------- readsb


def test_the_position_of_a_line_counts_at_its_reception_by_the_receiver() -> None:
    batch = decoded(readsb_line(10.0, age=0.3))
    assert number(batch, roles.TIME) == pytest.approx(BEGIN_S + 9.7, abs=1e-6)
    assert number(batch, roles.LATITUDE) == latitude(9.7)
    assert number(batch, roles.HEIGHT) == pytest.approx(35_000 * FOOT_M)
    assert number(batch, roles.GEOMETRIC) == pytest.approx(35_500 * FOOT_M)
    assert number(batch, roles.SPEED) == pytest.approx(450 * 1852 / 3600)
    assert word(batch, roles.ADDRESS) == 0x3C6444
    assert word(batch, roles.CODE) == 0o1000
    assert word(batch, roles.KIND) == 0
    assert callsign(batch) == b"DLH8JW"


@pytest.mark.parametrize(
    ("changes", "ground"),
    [({}, 0), ({"alt_baro": "ground"}, 1), ({"alt_baro": ..., "ground": True}, 1),
     ({"alt_baro": ...}, -1), ({"type": "mlat"}, -1)],
)  # fmt: skip
def test_the_ground_status_is_that_of_the_receiver(changes: Any, ground: int) -> None:
    assert word(decoded(readsb_line(**changes)), roles.GROUND) == ground


@pytest.mark.parametrize(
    ("changes", "kind"),
    [({"type": "adsr_icao"}, 0), ({"type": ...}, 0), ({"type": "mlat"}, 1),
     ({"type": ..., "mlat": ["lat", "lon"]}, 1), ({"mlat": ["track"]}, 0)],
)  # fmt: skip
def test_positions_by_multilateration_are_of_the_kind_mlat(changes: Any, kind: int) -> None:
    assert word(decoded(readsb_line(**changes)), roles.KIND) == kind


@pytest.mark.parametrize(
    "changes",
    [{"hex": "~2b1c3d"}, {"type": "tisb_icao"}, {"type": "adsc"}, {"type": "other"},
     {"type": ..., "tisb": ["lat", "lon"]}],
)  # fmt: skip
def test_positions_of_others_are_rejected(changes: Any) -> None:
    (reject,) = decoded(readsb_line(**changes)).rejected
    assert reject.code == RejectCode.UNKNOWN_KIND


def test_dump1090_has_names_of_its_own() -> None:
    batch = decoded(readsb_line(alt_baro=..., altitude=12_000, gs=..., speed=400, type=...))
    assert number(batch, roles.HEIGHT) == pytest.approx(12_000 * FOOT_M)
    assert number(batch, roles.SPEED) == pytest.approx(400 * 1852 / 3600)


def test_an_aircraft_without_position_is_no_report() -> None:
    batch = decoded(readsb_line(lat=..., lon=..., type="mode_s"))
    assert (batch.found, batch.other) == (0, 1)


def test_a_line_without_now_counts_at_its_reception() -> None:
    line = json.dumps(aircraft(age=0.5)).encode()
    batch = decoded(line, received_s=BEGIN_S + 1.0)
    assert number(batch, roles.TIME) == BEGIN_S + 0.5
    assert reasons(decoded(line)) == [
        (RejectCode.MISSING_FIELD, "now: expected a value, found none")
    ]


def test_a_wrong_clock_of_the_receiver_can_be_ignored() -> None:
    batch = decoded(readsb_line(-1560.0, age=0.5), received_s=BEGIN_S, at_reception=True)
    assert number(batch, roles.TIME) == BEGIN_S - 0.5


@pytest.mark.parametrize(
    ("message", "code"),
    [(b'{"now": 1533110400.0, "hex": "3c6444"', RejectCode.MALFORMED_JSON),
     (b"[1, 2]", RejectCode.MALFORMED_LINE),
     (b"\xff\xfe\x00", RejectCode.MALFORMED_LINE),
     (b'{"a":' * 100_000, RejectCode.MALFORMED_JSON),
     (readsb_line(lat=91.0), RejectCode.OUT_OF_RANGE),
     (readsb_line(lon=...), RejectCode.MISSING_FIELD),
     (readsb_line(hex="3c64"), RejectCode.NOT_A_NUMBER),
     (readsb_line(hex="000000"), RejectCode.OUT_OF_RANGE),
     (readsb_line(alt_baro=[1]), RejectCode.NOT_A_NUMBER),
     (readsb_line(alt_baro=900_000), RejectCode.OUT_OF_RANGE),
     (readsb_line(gs=float("inf")), RejectCode.NON_FINITE),
     (readsb_line(seen_pos=7200.0), RejectCode.OUT_OF_RANGE),
     (readsb_line(seen_pos="soon"), RejectCode.NOT_A_NUMBER),
     (readsb_line(now="1e999"), RejectCode.NON_FINITE),
     (readsb_line(now=5), RejectCode.OUT_OF_RANGE)],
)  # fmt: skip
def test_a_bad_line_is_rejected_and_the_next_one_is_read(message: bytes, code: RejectCode) -> None:
    batch = decoded(message, readsb_line(1.0))
    assert [one.code for one in batch.rejected] == [code]
    assert batch.places.tolist() == [2]


REGISTERS = {"roll": -20.0, "tas": 461, "mag_heading": 84.0, "ias": 272, "mach": 0.8}


def test_values_of_registers_count_while_they_are_known_to_be_new() -> None:
    """readsb repeats them for a minute; what has changed since the last message is new."""
    rolls = [
        (0.0, -18.0, False),  # may be old
        (1.0, -18.0, False),
        (2.0, -20.0, True),  # arrived in the last second
        (4.0, -20.0, True),  # at most 3 s old
        (4.5, -20.0, False),
        (9.0, -10.0, False),  # changed within the last 4.5 s
        (10.0, 0.0, True),
    ]
    lines = [readsb_line(s, **REGISTERS | {"roll": roll}) for s, roll, _ in rolls]
    batch = decoded(*lines)
    expected = [roll if new else np.nan for _, roll, new in rolls]
    np.testing.assert_array_equal(batch.numbers[roles.ROLL], expected)
    # The other register never changes: whether it is new is not known.
    assert np.isnan(batch.numbers[roles.HEADING]).all()
    assert batch.old == len(rolls)
    assert not np.isnan(batch.numbers[roles.SPEED]).any()


def test_ages_are_those_of_each_aircraft() -> None:
    batch = decoded(
        readsb_line(0.0, roll=1.0), readsb_line(0.5, roll=5.0, hex="4ca8d1"),
        readsb_line(1.0, roll=2.0), readsb_line(1.5, roll=5.0, hex="4ca8d1"),
    )  # fmt: skip
    np.testing.assert_array_equal(batch.numbers[roles.ROLL], [np.nan, np.nan, 2.0, np.nan])


@pytest.mark.parametrize(
    ("changes", "sigma_m"),
    [
        # 10 m within 95 %; times in tenths: 0.041 s at 231.5 m/s.
        ({"nac_p": 10, "seen_pos": 0.3}, np.hypot(10.0 / 2.448, 9.45)),
        ({"nac_p": 10, "seen_pos": 0.3, "gs": ...}, 10.0 / 2.448),
        # `now` alone is in tenths.
        ({"nac_p": 10, "seen_pos": 0.301}, np.hypot(10.0 / 2.448, 6.68)),
        # 186 m, all but one in 10**7.
        ({"seen_pos": 0.3}, np.hypot(186 / 5.678, 9.45)),
        ({"nac_p": 0, "rc": 0, "seen_pos": 0.3}, np.nan),
        ({"rc": ..., "nac_p": "high"}, np.nan),
        ({"nac_p": 10, "type": "mlat"}, np.nan),
    ],
)
def test_the_accuracy_is_that_of_the_aircraft_and_of_the_rounded_time(
    changes: dict[str, Any], sigma_m: float
) -> None:
    batch = decoded(readsb_line(10.0, **changes))
    assert batch.sigma_m is not None
    np.testing.assert_allclose(batch.sigma_m, [sigma_m], rtol=2e-3)


# ---------------------------------------------------------------- snapshots


def of_document(*texts: bytes, received_s: float | None = None) -> Batch:
    decoder = FeedDecoder()
    for text in texts:
        decoder.document(text, 0, received_s)
    return counted(decoder.drain())


def test_a_snapshot_has_a_time_for_all_its_aircraft() -> None:
    text = snapshot(10.0, [aircraft(10.0, 1.0), aircraft(10.0, 2.0, hex="4ca8d1")])
    batch = of_document(text)
    assert batch.numbers[roles.TIME].tolist() == [BEGIN_S + 9.0, BEGIN_S + 8.0]
    raw = batch.raw(1)
    assert text[batch.places[1] :].startswith(raw)
    assert json.loads(raw)["hex"] == "4ca8d1"


def test_a_position_repeated_by_later_snapshots_is_a_duplicate() -> None:
    """The times are rounded, so that the same position seems to be up to 0.2 s older or newer."""
    texts = [
        snapshot(second, [aircraft(second, age, lat=47.0)])
        for second, age in ((1.0, 0.3), (2.0, 1.2), (3.0, 2.4), (4.0, 0.2))
    ]
    batch = of_document(*texts)
    assert batch.duplicate == 2
    assert batch.numbers[roles.TIME].tolist() == pytest.approx([BEGIN_S + 0.7, BEGIN_S + 3.8])


def test_the_result_does_not_depend_on_the_form_of_a_snapshot() -> None:
    found = [aircraft(10.0, 1.0), aircraft(10.0, 0.0, hex="4ca8d1", type="mlat")]
    head = {"now": BEGIN_S + 10.0, "messages": 1}
    listed = [
        ["3c6444", 35_000, 450.0, 0.0, latitude(9.0), 8.5, 1.0, "adsb_icao", "DLH8JW", 5],
        ["4ca8d1", 35_000, 450.0, 0.0, latitude(10.0), 8.5, 0.0, "mlat", "DLH8JW", 5],
    ]
    forms = [
        snapshot(10.0, found),
        json.dumps(head | {"aircraft": found}).encode(),
        json.dumps(head | {"aircraft": found}, indent=4).encode(),
        json.dumps({"ac": found, "msg": "No error", "now": (BEGIN_S + 10.0) * 1000}).encode(),
        json.dumps({"files": [head | {"aircraft": listed}]}).encode(),
    ]
    results = [of_document(form) for form in forms]
    compared = [roles.TIME, roles.LATITUDE, roles.LONGITUDE, roles.HEIGHT, roles.SPEED]
    for result in results:
        np.testing.assert_array_equal(result.numbers[compared], results[0].numbers[compared])
        assert result.words[roles.KIND - roles.FIRST_WORD].tolist() == [0, 1]


def test_a_damaged_snapshot_is_rejected_from_there_on_and_the_next_is_read() -> None:
    good = snapshot(20.0, [aircraft(20.0)])
    bad = snapshot(10.0, [aircraft(10.0, hex="4ca8d1"), aircraft(10.0)])
    cut = bad[: bad.index(b'"3c6444"') + 3]
    batch = of_document(cut + good)
    assert batch.numbers[roles.TIME].tolist() == [BEGIN_S + 10.0, BEGIN_S + 20.0]
    assert [one.code for one in batch.rejected] == [RejectCode.MALFORMED_JSON]
    batch = of_document(good + cut)
    assert [one.code for one in batch.rejected] == [RejectCode.TRUNCATED]


def of_service(second: float, *found: Any) -> bytes:
    """Return a snapshot of a web service: its time is behind the list."""
    now = (BEGIN_S + second) * 1000
    return json.dumps({"ac": list(found), "msg": "No error", "now": now, "total": 1}).encode()


@pytest.mark.parametrize("between", [b"", b"\n", b" " * 70_000 + b"\n"])
def test_behind_a_fault_the_snapshots_of_services_are_read(between: bytes) -> None:
    """Regression: nothing behind the fault was read or counted."""
    bad = of_service(10.0, aircraft(10.0), aircraft(10.0, hex="4ca8d1")).replace(b'"DLH', b'"D"LH')
    good = [of_service(second, aircraft(second)) for second in (20.0, 30.0)]
    batch = of_document(between.join([bad, *good]))
    assert batch.numbers[roles.TIME].tolist() == [BEGIN_S + 20.0, BEGIN_S + 30.0]
    ((code, reason),) = reasons(batch)
    assert code == RejectCode.MALFORMED_JSON
    skipped = len(bad) - bad.index(b'{"hex"') + len(between)
    assert reason.endswith(f"; {skipped} octets skipped")


def test_what_remains_behind_a_fault_is_rejected_with_its_size() -> None:
    good, bad = of_service(20.0, aircraft(20.0)), of_service(10.0, {"hex": 1}).replace(b"}]", b"]")
    batch = of_document(good + bad)
    assert len(batch.places) == 1
    ((_, reason),) = reasons(batch)
    assert reason.endswith(f"; {len(bad) - bad.index(b'{', 1)} octets skipped")
    batch = of_document(b" " * 70_000 + good + b" " * 70_000 + b"<html>")
    assert len(batch.places) == 1
    assert reasons(batch)[0][1] == "expected a list of aircraft, found '<html>'; 6 octets skipped"


def test_a_snapshot_without_a_time_has_not_that_of_its_neighbours() -> None:
    """Regression: it had the time of the next one, or of an answer without aircraft before it."""
    good = of_service(20.0, aircraft(20.0))
    without = json.dumps({"ac": [aircraft(10.0, hex="4ca8d1")]}).encode()
    for text in (without + good, good + without):
        batch = of_document(text)
        assert batch.numbers[roles.TIME].tolist() == [BEGIN_S + 20.0]
        assert reasons(batch) == [(RejectCode.MISSING_FIELD, "now: expected a value, found none")]
    empty = json.dumps({"ac": None, "now": BEGIN_S + 5.0}).encode()
    for text in (empty + good, empty + snapshot(20.0, [aircraft(20.0)])):
        batch = of_document(text)
        assert batch.numbers[roles.TIME].tolist() == [BEGIN_S + 20.0]
        ((code, reason),) = reasons(batch)
        assert code == RejectCode.MALFORMED_JSON
        assert reason.endswith(f"; {len(empty)} octets skipped")


def test_a_recording_may_begin_within_a_snapshot() -> None:
    """The octets before the first whole snapshot are counted; a list may be all that remains."""
    good = snapshot(10.0, [aircraft(10.0)])
    rest = snapshot(5.0, [aircraft(5.0)])[100:]
    batch = of_document(rest + good)
    assert batch.numbers[roles.TIME].tolist() == [BEGIN_S + 10.0]
    assert len(batch.rejected) == 1
    batch = of_document(of_service(10.0, aircraft(10.0))[1:])
    assert batch.numbers[roles.TIME].tolist() == [BEGIN_S + 10.0]
    assert batch.rejected == []


@pytest.mark.parametrize("text", [b"", b"[]", b"{}", b"<html>", b'{"now": 1}', b'{"aircraft": 5}'])
def test_what_is_no_snapshot_is_one_reject_at_most(text: bytes) -> None:
    batch = of_document(text)
    assert batch.numbers.shape[1] == 0
    assert len(batch.rejected) <= 1
    assert bool(batch.rejected) == bool(text)


def test_an_empty_snapshot_has_no_reports() -> None:
    assert of_document(snapshot(1.0, [])).found == 0


# ---------------------------------------------------------------- BaseStation


def test_a_position_has_the_values_of_earlier_messages() -> None:
    batch = decoded(
        base_station(0.0, "1", f11="DLH8JW  "),
        base_station(0.5, "4", f13="450", f14="1", f17="-640"),
        base_station(0.6, "6", f18="1000"),
        base_station(1.0),
    )
    assert (batch.found, batch.other) == (1, 3)
    assert number(batch, roles.TIME) == BEGIN_S + 1.0
    assert number(batch, roles.HEIGHT) == pytest.approx(35_000 * FOOT_M)
    assert number(batch, roles.SPEED) == pytest.approx(450 * 1852 / 3600)
    assert number(batch, roles.TRACK) == 1.0
    assert number(batch, roles.CLIMB) == pytest.approx(-640 * FOOT_M / 60)
    assert word(batch, roles.CODE) == 0o1000
    assert word(batch, roles.GROUND) == 0
    assert callsign(batch) == b"DLH8JW"


def test_an_old_speed_is_not_that_of_a_position() -> None:
    batch = decoded(base_station(0.0, "4", f13="450"), base_station(5.1))
    assert np.isnan(number(batch, roles.SPEED))


def test_a_surface_position_is_on_the_ground_and_h_marks_geometric_altitudes() -> None:
    assert word(decoded(base_station(0.0, "2", f15="47.0", f16="8.5")), roles.GROUND) == 1
    assert word(decoded(base_station(0.0, f22="-1")), roles.GROUND) == 1
    batch = decoded(base_station(0.0, f12="35500H"))
    assert np.isnan(number(batch, roles.HEIGHT))
    assert number(batch, roles.GEOMETRIC) == pytest.approx(35_500 * FOOT_M)


def test_results_of_mlat_client_are_of_the_kind_mlat() -> None:
    line = base_station(0.0, prefix="MLAT").rstrip() + b",5,,45\n"
    assert word(decoded(line), roles.KIND) == 1


@pytest.mark.parametrize("zone_h", [-9.5, 0.0, 2.0, 5.75])
def test_the_time_zone_is_that_of_the_reception_or_of_the_option(zone_h: float) -> None:
    line = base_station(0.0, zone_s=zone_h * 3600.0)
    live = decoded(line, received_s=BEGIN_S + 0.3)
    recorded = decoded(line, utc_offset_s=zone_h * 3600.0)
    assert number(live, roles.TIME) == number(recorded, roles.TIME) == BEGIN_S


def test_a_clock_that_is_wrong_by_no_time_zone_is_rejected_with_what_to_do() -> None:
    ((code, reason),) = reasons(decoded(base_station(-400.0), received_s=BEGIN_S))
    assert code == RejectCode.OUT_OF_RANGE
    assert "-400 s" in reason
    assert 'times = "reception"' in reason
    late = decoded(base_station(-400.0), received_s=BEGIN_S, at_reception=True)
    assert number(late, roles.TIME) == BEGIN_S


@pytest.mark.parametrize(
    ("line", "code"),
    [(b"MSG,3,1,1", RejectCode.WRONG_FIELD_COUNT),
     (base_station(0.0, f5="XYZ"), RejectCode.NOT_A_NUMBER),
     (base_station(0.0, f7="2018-08-01"), RejectCode.NOT_A_NUMBER),
     (base_station(0.0, f7="2018/02/30"), RejectCode.OUT_OF_RANGE),
     (base_station(0.0, f15="north"), RejectCode.NOT_A_NUMBER),
     (base_station(0.0, f16=""), RejectCode.MISSING_FIELD)],
)  # fmt: skip
def test_a_bad_message_is_rejected(line: bytes, code: RejectCode) -> None:
    assert [one.code for one in decoded(line).rejected] == [code]


# ---------------------------------------------------------------- mlat-server


@pytest.mark.parametrize("form", [11, 12, 13, 18, 19])
def test_rows_of_every_release_of_mlat_server(form: int) -> None:
    batch = decoded(multilaterated(1.0, form))
    assert number(batch, roles.TIME) == BEGIN_S + 1.0
    assert number(batch, roles.LATITUDE) == round(latitude(1.0), 4)
    height, none = roles.HEIGHT, roles.GEOMETRIC
    if form not in (13, 19):
        height, none = none, height
    assert number(batch, height) == pytest.approx(35_000 * FOOT_M)
    assert np.isnan(number(batch, none))
    assert word(batch, roles.KIND) == 1
    assert callsign(batch) == b"DLH8JW"
    assert np.isnan(number(batch, roles.SPEED)) == (form < 18)
    assert batch.sigma_m is not None
    assert batch.sigma_m[0] == pytest.approx(45.0 / np.sqrt(2.0))


def test_an_unknown_error_of_multilateration_is_no_accuracy() -> None:
    batch = decoded(multilaterated(1.0, f8="-1"))
    assert batch.sigma_m is not None
    assert np.isnan(batch.sigma_m[0])


@pytest.mark.parametrize(
    ("line", "code"),
    [(b"1533110400.000,3C6444,,,47.0\n", RejectCode.WRONG_FIELD_COUNT),
     (multilaterated(0.0, f11='"a,b'), RejectCode.MALFORMED_LINE),
     (multilaterated(0.0, f5="nan"), RejectCode.MISSING_FIELD)],
)  # fmt: skip
def test_a_bad_row_is_rejected(line: bytes, code: RejectCode) -> None:
    assert [one.code for one in decoded(line).rejected] == [code]


# ---------------------------------------------------------------- text in pieces

MIXED = b"".join(
    [
        readsb_line(0.0), b"\n", base_station(0.0, "1", f11="X1", f5="4CA8D1"), b"bad\n",
        multilaterated(0.5, f2="40001A"), readsb_line(1.0), readsb_line(1.0),
    ]
)  # fmt: skip


def of_pieces(*blocks: bytes, bytes_max: int = RECORD_BYTES_MAX) -> Batch:
    lines, decoder = Lines(bytes_max), FeedDecoder()
    for block in blocks:
        for piece in lines.push(block):
            for fault in piece.faults:
                decoder.reject(fault.place, fault.code, fault.reason, fault.raw)
            for k, place in enumerate(piece.places.tolist()):
                decoder.line(piece.raw(k), place, BEGIN_S)
    return counted(decoder.drain())


@pytest.mark.slow
def test_the_result_does_not_depend_on_where_the_text_is_split() -> None:
    whole = of_pieces(MIXED)
    assert (whole.found, whole.duplicate, whole.other, len(whole.rejected)) == (5, 1, 1, 1)
    for cut in range(len(MIXED) + 1):
        parts = of_pieces(MIXED[:cut], MIXED[cut:])
        np.testing.assert_array_equal(parts.numbers, whole.numbers)
        np.testing.assert_array_equal(parts.words, whole.words)
        assert (parts.places.tolist(), parts.rejected, parts.other) == (
            whole.places.tolist(), whole.rejected, whole.other,
        )  # fmt: skip
    octets = of_pieces(*(MIXED[k : k + 1] for k in range(len(MIXED))))
    np.testing.assert_array_equal(octets.numbers, whole.numbers)


def test_a_line_of_100_mb_is_one_reject_and_takes_no_memory() -> None:
    lines, block = Lines(), b"x" * (1 << 20)
    found = [piece for _ in range(100) for piece in lines.push(block)]
    assert found == []
    assert len(lines.carry) <= RECORD_BYTES_MAX
    (piece,) = [one for one in lines.push(b"\n" + readsb_line()) if len(one.begins) or one.faults]
    assert [fault.code for fault in piece.faults] == [RejectCode.TOO_LARGE]
    assert piece.places.tolist() == [2]


def test_what_is_retained_of_aircraft_is_bounded() -> None:
    known = Aircraft(list[int])
    for address in range(3 * AIRCRAFT_MAX):
        known.of(address, float(address)).append(1)
        assert len(known) <= AIRCRAFT_MAX
    assert known.of(3 * AIRCRAFT_MAX - 1, 0.0) == [1]
    assert known.of(0, 0.0) == []
