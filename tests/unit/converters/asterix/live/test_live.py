"""Live decoding of datagrams in batches, with state from earlier batches."""

import numpy as np
import pytest

from multiradar_converters.asterix.decoding.editions import Editions, parse_editions
from multiradar_converters.asterix.decoding.local_plane import ReferencePoint
from multiradar_converters.asterix.framing.containers import blocks_of_datagrams
from multiradar_converters.asterix.framing.datagrams import Datagrams
from multiradar_converters.asterix.live import reception as live
from multiradar_converters.asterix.live.batch import LiveBatch
from multiradar_converters.asterix.live.copies import RecentRecords
from multiradar_converters.asterix.live.reception import LiveDecoder, LiveOptions
from multiradar_schemas.measurements.directions import REPORT_SCHEMA
from support.aircraft.registers import item_250, write
from support.asterix.octets import block, north_mark, plot_001, plot_048, record, time_of_day
from support.asterix.surface_records import (
    MODE_S_MLAT,
    MULTILATERATION,
    adsb_021,
    mlat_020,
    reference_019,
    surface_010,
)

DAY_S = 86_400.0
#: A midnight, Unix time.
MIDNIGHT_S = 19_675 * DAY_S
NOON_S = MIDNIGHT_S + 43_200.0
RADAR = 0x1482
NAMES = {(RADAR, "radar"): "20-130"}


def datagrams(*sent: tuple[float, bytes]) -> Datagrams:
    lengths = np.array([len(one) for _, one in sent], dtype=np.int64)
    ends = np.cumsum(lengths)
    data = np.frombuffer(bytearray().join(one for _, one in sent), dtype=np.uint8)
    return Datagrams(data, ends - lengths, ends, np.array([when for when, _ in sent], np.float64))


def decoder(**options: object) -> LiveDecoder:
    return LiveDecoder(LiveOptions(**({"names": NAMES} | options)))  # type: ignore[arg-type]


def times(batch: LiveBatch) -> list[float]:
    found: list[float] = batch.frame["time_s"].to_list()
    return found


def balanced(batch: LiveBatch, sent: Datagrams) -> bool:
    """Return whether every octet of every datagram is accounted for."""
    became = np.stack(list(batch.octets.values())).sum(axis=0)
    return bool((became == sent.ends - sent.begins).all())


def test_a_plot_becomes_a_measurement_dated_by_its_reception() -> None:
    sent = datagrams((NOON_S + 0.4, block(48, plot_048(43_200.0))))
    batch = decoder().decode(sent)
    assert dict(batch.frame.schema) == dict(REPORT_SCHEMA)
    assert times(batch) == [NOON_S]
    assert batch.frame["sensor_id"].to_list() == ["20-130"]
    assert batch.frame["mode_s_address"].to_list() == ["3c660c"]
    assert balanced(batch, sent)


def test_registers_of_a_plot_are_checked_as_in_recordings() -> None:
    air = write("6,0", magnetic_heading=90.0, mach=0.8)
    plots = [
        plot_048(43_200.0, registers=item_250(bds60=air)),
        plot_048(43_201.0, registers=item_250(bds50=air, bds60=air)),
    ]
    batch = decoder().decode(datagrams((NOON_S + 1.5, block(48, *plots))))
    assert batch.frame["mach"].to_list() == [pytest.approx(0.8), None]
    assert "roll_deg" not in batch.frame.columns


@pytest.mark.parametrize(
    ("letters", "callsign"),
    [
        ("10 c2 38 29 78 20", "DLH8JW"),
        ("10 c2 20 e0 a8 20", "DLH 8J"),
        # An unassigned character, and zeros: inside, and as padding.
        ("10 c2 21 e0 a8 20", None),
        ("10 c2 00 e0 a8 20", None),
        ("10 c2 38 28 00 00", "DLH8J"),
        ("82 08 20 82 08 20", None),
    ],
)
def test_inner_blanks_of_callsigns_are_kept_invalid_characters_are_not(
    letters: str, callsign: str | None
) -> None:
    items = [(1, "14 82"), (2, time_of_day(43_200.0)), (3, "40"), (4, "32 00 40 00"), (9, letters)]
    batch = decoder().decode(datagrams((NOON_S + 0.4, block(48, record(*items)))))
    assert batch.frame["callsign"].to_list() == [callsign]


@pytest.mark.parametrize(
    ("of_day", "received", "time"),
    [
        (DAY_S - 0.5, 0.25, -0.5),
        (0.25, -0.125, 0.25),
        (DAY_S - 0.5, -0.25, -0.5),
        (0.5, 0.75, 0.5),
    ],
)
def test_the_date_is_right_about_midnight(of_day: float, received: float, time: float) -> None:
    sent = datagrams((MIDNIGHT_S + received, block(48, plot_048(of_day))))
    assert times(decoder().decode(sent)) == [MIDNIGHT_S + time]


def test_a_fine_time_is_right_about_midnight() -> None:
    one = decoder(names={(107, "adsb"): "adsb"}, editions=parse_editions(["021=2.4"]))
    reports = block(21, adsb_021(DAY_S - 0.008, None, fine=(1, 0.001)))
    assert times(one.decode(datagrams((MIDNIGHT_S + 0.3, reports)))) == [MIDNIGHT_S + 0.001]


@pytest.mark.parametrize("passed", [-1.5, 0.25, 2.5])
def test_a_truncated_time_is_right_about_midnight(passed: float) -> None:
    """It begins again with the day, which is no multiple of 512 s."""
    one = decoder()
    one.decode(datagrams((MIDNIGHT_S - 3.9, north_mark(DAY_S - 4.0))))
    plot = block(1, plot_001(passed % DAY_S % 512))
    assert times(one.decode(datagrams((MIDNIGHT_S + passed + 0.3, plot)))) == [MIDNIGHT_S + passed]


def test_the_last_north_mark_counts_in_the_next_batch() -> None:
    """The radar's clock is 300 s off: the reception alone would put its plots 512 s too late."""
    one = decoder()
    one.decode(datagrams((NOON_S, north_mark(43_200.0 - 300.0))))
    batch = one.decode(datagrams((NOON_S + 1.0, block(1, plot_001(43_201.0 - 300.0)))))
    assert times(batch) == [NOON_S + 1.0 - 300.0]


def test_without_a_north_mark_the_reception_is_the_reference() -> None:
    batch = decoder().decode(datagrams((NOON_S + 0.5, block(1, plot_001(43_200.0)))))
    assert times(batch) == [NOON_S]


def test_the_scan_period_follows_from_north_marks_of_earlier_batches() -> None:
    one = decoder()
    for turn in range(4):
        one.decode(datagrams((NOON_S + 4.0 * turn, north_mark(43_200.0 + 4.0 * turn))))
    plot = block(1, plot_001(None, azimuth_deg=90.0))
    assert times(one.decode(datagrams((NOON_S + 13.5, plot)))) == [NOON_S + 13.0]


def test_the_sensors_file_reports_the_turn_until_north_marks_do() -> None:
    one = decoder(scan_periods={RADAR: 8.0})
    one.decode(datagrams((NOON_S, north_mark(43_200.0))))
    plot = block(1, plot_001(None, azimuth_deg=90.0))
    assert times(one.decode(datagrams((NOON_S + 2.5, plot)))) == [NOON_S + 2.0]


def test_a_message_that_reports_no_azimuth_does_not_hide_the_last_north_mark() -> None:
    one = decoder(scan_periods={RADAR: 8.0})
    one.decode(datagrams((NOON_S, north_mark(43_200.0))))
    stopped = block(2, record((1, "1482"), (2, "08"), (4, time_of_day(43_201.0))))
    one.decode(datagrams((NOON_S + 1.0, stopped)))
    plot = block(1, plot_001(None, azimuth_deg=90.0))
    assert times(one.decode(datagrams((NOON_S + 2.5, plot)))) == [NOON_S + 2.0]


def test_north_marks_of_two_networks_give_one_scan_period() -> None:
    one = decoder()
    for turn in range(4):
        mark = north_mark(43_200.0 + 4.0 * turn)
        one.decode(datagrams((NOON_S + 4.0 * turn, mark), (NOON_S + 4.0 * turn + 0.1, mark)))
    plot = block(1, plot_001(None, azimuth_deg=90.0))
    assert times(one.decode(datagrams((NOON_S + 13.5, plot)))) == [NOON_S + 13.0]


def test_without_time_and_turn_the_reception_is_the_time() -> None:
    plot = block(1, plot_001(None))
    assert times(decoder().decode(datagrams((NOON_S + 0.25, plot)))) == [NOON_S + 0.25]


def test_the_same_record_of_two_networks_counts_once_within_the_window() -> None:
    one, plot = decoder(), block(48, plot_048(43_200.0))
    first = one.decode(datagrams((NOON_S + 0.1, plot), (NOON_S + 0.11, plot)))
    assert len(first.frame) == 1
    assert first.records["duplicate"].tolist() == [0, 1]
    second = one.decode(datagrams((NOON_S + 10.0, plot), (NOON_S + 20.5, plot)))
    assert second.records["duplicate"].tolist() == [1, 0]
    assert second.records["measurement"].tolist() == [0, 1]


def test_of_two_sources_equal_octets_are_two_records() -> None:
    """In category 001 the second record of a block does not name its source."""
    nameless = record((2, "20"), (3, "1900 4000"), (7, "3280"))
    sent = datagrams(
        (NOON_S, block(1, plot_001(100.0), nameless)),
        (NOON_S, block(1, plot_001(100.0, source="1401"), nameless)),
    )
    both = NAMES | {(0x1401, "radar"): "20-1"}
    batch = decoder(names=both, behind_max_s=80_000.0).decode(sent)
    assert batch.frame["sensor_id"].to_list() == ["20-130", "20-130", "20-1", "20-1"]


def test_a_failure_discards_retained_records(monkeypatch: pytest.MonkeyPatch) -> None:
    one, sent = decoder(), datagrams((NOON_S, block(48, plot_048(43_200.0))))
    with monkeypatch.context() as patch:
        patch.setattr(live, "_frame", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            one.decode(sent)
    assert len(one.decode(sent).frame) == 1


@pytest.mark.parametrize("seed", range(3))
def test_copies_are_found_as_a_plain_search_finds_them(seed: int) -> None:
    random = np.random.default_rng(seed)
    same, source = random.integers(0, 40, 3000), random.integers(0, 3, 3000)
    received_s = np.sort(random.uniform(0.0, 500.0, 3000))
    window_s = random.choice([0.5, 5.0], 3000)
    last: dict[tuple[int, int], float] = {}
    expected = []
    for key, now_s, window in zip(
        zip(same.tolist(), source.tolist(), strict=True),
        received_s.tolist(),
        window_s.tolist(),
        strict=True,
    ):
        expected.append(now_s - last.get(key, -np.inf) <= window)
        last[key] = now_s
    recent, found = RecentRecords(1.0, capacity=4096), []
    for cut in np.array_split(np.arange(3000), 17):
        found += recent.repeated(same[cut], source[cut], received_s[cut], window_s[cut]).tolist()
    assert found == expected


@pytest.mark.parametrize("same", [-7046029254386353131, 0])
def test_any_record_is_a_copy_only_of_itself(same: int) -> None:
    # The first of them has the key 0.
    recent, none = RecentRecords(1.0, capacity=8), np.zeros(1, np.int64)
    for again in (False, True):
        assert recent.repeated(none + same, none, np.zeros(1), np.ones(1)).tolist() == [again]
    recent.clear()
    assert not recent.repeated(none + same, none, np.zeros(1), np.ones(1)).any()


def test_where_there_are_too_many_the_oldest_is_discarded() -> None:
    recent = RecentRecords(1.0, capacity=8)
    keys, none = np.arange(12), np.zeros(12, np.int64)
    assert not recent.repeated(keys, none, np.arange(12.0), np.full(12, 100.0)).any()
    again = recent.repeated(keys[::-1].copy(), none, np.full(12, 12.0), np.full(12, 100.0))
    assert again.tolist() == [True] * 8 + [False] * 4


def test_a_fixed_code_without_a_time_comes_again_every_turn() -> None:
    one, plot = decoder(), block(1, plot_001(None))
    batches = [one.decode(datagrams((NOON_S + 4.0 * turn, plot))) for turn in range(3)]
    assert [len(batch.frame) for batch in batches] == [1, 1, 1]


def test_a_time_long_before_the_reception_is_rejected() -> None:
    sent = datagrams((NOON_S, block(48, plot_048(43_200.0 - 4000.0))))
    batch = decoder().decode(sent)
    (rejected,) = batch.rejected
    assert (rejected.code, batch.records["refused"].tolist()) == ("OUT_OF_RANGE", [1])
    assert rejected.reason == "a time of day more than 3600 s before reception"
    assert len(decoder(behind_max_s=5000.0).decode(sent).frame) == 1


def test_an_unknown_source_is_rejected_with_its_octets() -> None:
    plot = plot_048(43_200.0, source="0307")
    sent = datagrams((NOON_S, block(48, plot_048(43_200.0)) + block(48, plot)))
    batch = decoder().decode(sent)
    (rejected,) = batch.rejected
    assert (rejected.code, rejected.octets) == ("UNKNOWN_SENSOR", plot)
    assert rejected.reason == "no sensor in the sensors file has this SAC and SIC: 3-7"
    assert rejected.offset == len(block(48, plot_048(43_200.0))) + 3
    assert len(batch.frame) == 1


def test_a_source_that_measures_something_else_is_rejected() -> None:
    report = record((1, "1482"), (6, "21b8c5 0844cb"), (11, "3c660c"), (12, "546000"), (16, "15b8"))
    (rejected,) = decoder().decode(datagrams((NOON_S, block(21, report)))).rejected
    assert rejected.code == "UNKNOWN_KIND"
    assert rejected.reason == "the sensors file does not allow adsb reports from sensor 20-130"


def test_other_categories_are_counted_and_nothing_more() -> None:
    track = block(62, record((1, "0004"), (4, "546000"), (12, "0001")))
    artas, strange = block(31, b"\x80\x01"), block(33, b"\x80\x01")
    sent = datagrams((NOON_S, track + artas), (NOON_S, strange))
    batch = decoder().decode(sent)
    assert batch.categories == {62: 1}
    assert batch.octets["skipped"].tolist() == [len(artas), 0]
    assert [one.reason for one in batch.rejected] == ["category 033 is unknown"]
    assert balanced(batch, sent)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x30",
        b"\x30\x00\x00",
        b"\x30\xff\xff\x80",
        bytes(65_507),
        b"\xff" * 65_507,
        block(48, plot_048(43_200.0))[:-1],
        block(48, plot_048(43_200.0)) + b"\x30\x00",
    ],
    ids=("empty", "one", "no length", "long", "zeros", "ones", "cut", "trailing"),
)
def test_hostile_datagrams_are_rejected_and_the_next_one_is_read(content: bytes) -> None:
    good = block(48, plot_048(43_200.0))
    sent = datagrams((NOON_S, content), (NOON_S, good))
    batch = decoder().decode(sent)
    assert batch.rejected
    assert {one.datagram for one in batch.rejected} == {0}
    assert balanced(batch, sent)
    assert len(batch.frame) + int(batch.records["duplicate"].sum()) >= 1
    assert sum(len(one.octets) for one in batch.rejected) == batch.octets["quarantined"].sum()


def old_report(number: int) -> bytes:
    """Write a report of category 021, edition 0.26: other places, another scale of positions."""
    degrees = (39.0 + 0.001 * number, 0.5)
    position = " ".join(f"{round(one * 8388608 / 45):08x}" for one in degrees)
    items = [(1, "1482"), (2, "00 00"), (3, time_of_day(43_200.0 + number)), (4, position)]
    return block(21, record(*items, (5, "3c660c"), (10, "0578")))


@pytest.mark.parametrize("chosen", [[], ["021=0.26"], ["20-130/021=0.26"]])
def test_the_edition_of_a_source_is_right_though_blocks_come_alone(chosen: list[str]) -> None:
    one = decoder(names={(RADAR, "adsb"): "20-130"}, editions=parse_editions(chosen))
    for number in range(3):
        batch = one.decode(datagrams((NOON_S + number, old_report(number))))
        assert batch.frame["latitude_deg"].to_list() == pytest.approx([39.0 + 0.001 * number])


def test_an_edition_detected_from_few_blocks_is_revised_by_more() -> None:
    """A block that fits two layouts counts for the newest until another fits one alone."""
    both = block(21, record((1, "1482"), (5, "3c660c")))
    blocks, _ = blocks_of_datagrams(datagrams((NOON_S, both)), np.zeros(1, np.int64))
    more, _ = blocks_of_datagrams(datagrams((NOON_S, old_report(0))), np.zeros(1, np.int64))
    source = np.array([RADAR])
    editions = Editions()
    editions.detect(blocks, source, revise=True)
    assert editions.found[21, RADAR].editions[0] == "2.7"
    editions.detect(more, source, revise=True)
    assert editions.found[21, RADAR].editions[0] == "0.26"
    one = decoder(names={(RADAR, "adsb"): "20-130"}, editions=Editions())
    one.decode(datagrams((NOON_S, both)))
    batch = one.decode(datagrams((NOON_S, old_report(0))))
    assert batch.frame["latitude_deg"].to_list() == pytest.approx([39.0])


def test_of_unknown_sources_nothing_is_retained() -> None:
    """There may be sixty thousand of them, each with its clock and its editions."""
    editions = parse_editions([])
    one = decoder(editions=editions)
    every = [
        (NOON_S, block(21, record((1, f"{source:04x}"), (11, "3c660c"), (12, "546000"))))
        for source in range(500)
    ]
    batch = one.decode(datagrams(*every))
    assert len(batch.rejected) == 500
    assert set(editions.found) <= {(21, -1), (21, RADAR)}


@pytest.mark.slow
def test_a_source_of_an_unknown_edition_is_quarantined_until_it_fits() -> None:
    """It is tried again and again: a link may be damaged for a while."""
    bad = block(48, record((1, "1482"), (2, "000001"), (7, "80")))
    one = decoder()
    for number in range(300):
        sent = datagrams((NOON_S + number, bad))
        batch = one.decode(sent)
        assert balanced(batch, sent)
    assert "300" not in batch.rejected[0].reason
    assert "blocks match no known edition (1.32" in batch.rejected[0].reason
    good = [
        one.decode(datagrams((NOON_S + number, block(48, plot_048(43_200.0 + number)))))
        for number in range(300, 700)
    ]
    assert good[0].frame.height == 0
    assert [batch.frame.height for batch in good[-100:]] == [1] * 100


def test_footers_of_datagrams_are_framing_once_some_agree() -> None:
    one, rejected = decoder(), []
    for number in range(20):
        octets = block(48, plot_048(43_200.0 + number)) + number.to_bytes(8, "big")
        sent = datagrams((NOON_S + number, octets))
        batch = one.decode(sent)
        assert balanced(batch, sent)
        assert times(batch) == [NOON_S + number]
        rejected.append(len(batch.rejected))
        if not batch.rejected:
            assert batch.octets["framing"].tolist() == [8]
    assert rejected == [1] * 4 + [0] * 16


@pytest.mark.slow
def test_clocks_and_latencies_of_live_sensors_are_those_of_their_latest_messages() -> None:
    one = decoder()
    for number in range(30):
        time_s = 43_200.0 + number
        sent = datagrams((NOON_S + number + 1.5, block(48, plot_048(time_s))))
        batch = one.decode(sent)
    assert batch.clocks["20-130"]["alarm"] == "clock"
    assert "1.50 s behind reception" in str(batch.clocks["20-130"]["reason"])
    for number in range(30, 600):
        time_s = 43_200.0 + number
        batch = one.decode(datagrams((NOON_S + number + 0.25, block(48, plot_048(time_s)))))
    assert batch.clocks["20-130"] == {
        "messages": 512,
        "clock_offset_s": -0.25,
        "latency_min_s": 0.25,
        "latency_median_s": 0.25,
        "latency_p99_s": 0.25,
        "alarm": None,
        "reason": None,
    }


def airport(**options: object) -> LiveDecoder:
    names = {(107, "mlat"): "mlat", (7, "radar"): "surface"}
    return decoder(names=names, **options)


def test_a_surface_radar_and_multilateration_are_received() -> None:
    mlat = surface_010(
        43_200.0, source=MULTILATERATION, descriptor=MODE_S_MLAT, local=(0, 0), address="3c660c",
        deviations=(3.0, 4.0),
    )  # fmt: skip
    plot = surface_010(43_200.0, polar=(1063, 219.375))
    one = airport(references={107: ReferencePoint(41.3, 2.08)})
    frame = one.decode(datagrams((NOON_S + 0.4, block(10, mlat) + block(10, plot)))).frame
    assert frame["sensor_id"].to_list() == ["mlat", "surface"]
    assert frame["latitude_deg"].to_list() == [pytest.approx(41.3), None]
    assert frame["position_sigma_m"].to_list() == [pytest.approx(12.5**0.5), None]
    assert frame["detection"].to_list() == [None, "psr"]


def test_a_reference_point_that_is_reported_counts_from_then_on() -> None:
    one = airport()
    report = block(20, mlat_020(43_200.0, local=(0, 0)))
    rejected = one.decode(datagrams((NOON_S + 0.4, report)))
    assert "reference point is unknown" in rejected.rejected[0].reason
    one.decode(datagrams((NOON_S + 1.0, block(19, reference_019(43_201.0, 41.5, 2.25)))))
    report = block(20, mlat_020(43_202.0, local=(0, 0)))
    found = one.decode(datagrams((NOON_S + 2.4, report)))
    assert found.frame["latitude_deg"].to_list() == [pytest.approx(41.5)]


def test_a_site_of_zero_is_none_and_a_later_report_replaces_an_earlier_one() -> None:
    """Regression: 0, 0 of a system without a site remained its reference point."""

    def latitudes(one: LiveDecoder, *points: tuple[float, float]) -> list[float]:
        status = (block(19, reference_019(43_200.0, *point)) for point in points)
        reports = b"".join(status) + block(20, mlat_020(43_200.0 + len(points), local=(0, 0)))
        batch = one.decode(datagrams((NOON_S + 9.0, reports)))
        assert len(batch.frame) + len(batch.rejected) == 1
        found: list[float] = batch.frame["latitude_deg"].to_list()
        return [] if batch.rejected else found

    one = airport()
    assert latitudes(one, (0.0, 0.0)) == []
    assert latitudes(one, (0.0, 0.0), (41.5, 2.25)) == [pytest.approx(41.5)]
    assert latitudes(one, (41.4, 2.25), (41.3, 2.25), (0.0, 0.0)) == [pytest.approx(41.3)]
    names = {(107, "mlat"): "mlat"}
    one.use(LiveOptions(names=names, references={107: ReferencePoint(45.0, 2.0)}))
    assert latitudes(one, *[(41.2, 2.25)] * 4) == [pytest.approx(45.0)]
    one.use(LiveOptions(names=names))
    assert latitudes(one, *[(0.0, 0.0)] * 5) == [pytest.approx(41.2)]


def test_sources_that_are_added_are_decoded_and_the_others_go_on() -> None:
    one = decoder()
    both = [
        (NOON_S + 0.4, block(48, plot_048(43_200.0))),
        (NOON_S + 0.5, block(48, plot_048(43_200.1, source="1483"))),
    ]
    first = one.decode(datagrams(*both))
    assert first.frame["sensor_id"].to_list() == ["20-130"]
    one.use(LiveOptions(names=NAMES | {(0x1483, "radar"): "20-131"}))
    later = [
        (NOON_S + 4.4, block(48, plot_048(43_204.0))),
        (NOON_S + 4.5, block(48, plot_048(43_204.1, source="1483"))),
    ]
    sent = datagrams(*later)
    second = one.decode(sent)
    assert second.frame["sensor_id"].to_list() == ["20-130", "20-131"]
    assert balanced(second, sent)
    assert set(second.clocks) == {"20-130", "20-131"}
    # A copy of what came before the change is still one.
    again = one.decode(datagrams(both[0]))
    assert len(again.frame) == 0
