"""Figures of ASTERIX recordings, decoded window by window with bounded memory.

Blocks, editions, times and checks are those of the conversion. Times that a radar truncates are
resolved within a window, in which it repeats its service messages; equal records are found within a
window, too.
"""

import math
import re
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix import reported_biases
from multiradar_converters.asterix.decoding.checks import (
    Rejection,
    aircraft,
    has_position,
    impossible_tracks,
    misplaced,
    unreferenced,
    untimed,
)
from multiradar_converters.asterix.decoding.editions import Editions, source_name, sources_of
from multiradar_converters.asterix.decoding.gathering import (
    SENSOR_STATUS,
    SYSTEM_TRACKS,
    Gathered,
    Rows,
    decode_blocks,
)
from multiradar_converters.asterix.decoding.local_plane import local_only, located
from multiradar_converters.asterix.decoding.sensor_clocks import (
    Differences,
    of_reports,
    of_services,
)
from multiradar_converters.asterix.decoding.targets import NOT_AIRCRAFT, flag_bits
from multiradar_converters.asterix.decoding.timing import (
    KINDS,
    FileDays,
    Timed,
    days_of_file,
    reported_references,
    services_in_order,
    time_targets,
)
from multiradar_converters.asterix.file_order import DATED_FROM_S, FileTimes, file_times
from multiradar_converters.asterix.framing.containers import Blocks
from multiradar_converters.asterix.framing.windows import block_windows
from multiradar_converters.asterix.layout.columns import Integers, Numbers
from multiradar_converters.asterix.layout.program import Walked
from multiradar_converters.asterix.table import repeated
from multiradar_converters.distinct import distinct
from multiradar_converters.inspection.reports import Reports
from multiradar_converters.inspection.survey import Antenna, FileSurvey, Survey
from multiradar_schemas.reject import RejectCode

#: Recordings of more octets than this are sampled for the figures of plots.
DETAILED_OCTETS_MAX = 1 << 28

#: Times of reception of a window that are retained, of reports and of service messages each.
DIFFERENCES_MAX = 2_000

Octets = NDArray[np.uint8]

FAR_OFF = "a time that differs by more than an hour from neighbouring times"

Item = TypeVar("Item")

_DAY_S = 86_400.0
_PLACE = re.compile(r", at octet \d+ of the block$|, after \d+ of \d+ octets$")
_BDS_CATEGORY, _BDS_ITEM, _BDS_OCTETS = 48, "250", 8


def inspect_asterix(
    path: Path, survey: Survey, editions: Editions, advance: Callable[[int], None], every: int = 1
) -> None:
    """Add a recording to a survey.

    Parameters
    ----------
    path : Path
        The file.
    survey : Survey
        Extended.
    editions : Editions
        Editions selected and found so far; extended.
    advance : callable
        Called with octets read.
    every : int
        Plots of each such window are in the figures of plots; 1: all.

    Raises
    ------
    LayoutError
        The file cannot be read.
    """
    recording: _Recording | None = None
    chosen = editions.copied()
    windows = _ahead(_decoded(_ahead(block_windows(path)), editions, every))
    for gathered, registers in windows:
        blocks = gathered.blocks
        if recording is None:
            account = FileSurvey(path.name, blocks.form, 0)
            recording = _Recording(survey, account, partial(_all_times, path, chosen))
        recording.add(gathered, registers)
        advance(blocks.size)
    names = editions.names()
    for (category, source), one in survey.categories.items():
        one.edition = names.get(f"{category:03d}", {}).get(source, "")
    reasons = [editions.why_unfit(*pair) for pair in sorted(editions.unfit)]
    survey.unknown_editions += [one for one in reasons if one not in survey.unknown_editions]


def _all_times(path: Path, editions: Editions) -> Iterator[FileTimes]:
    """Yield the times of all records of a file, window by window."""
    days = _Days()
    for gathered, _ in _decoded(block_windows(path), editions, 1):
        timed, _ = time_targets(gathered)
        yield file_times(gathered, timed, days.add(gathered, timed))


def _decoded(
    windows: Iterator[Blocks], editions: Editions, every: int
) -> Iterator[tuple[Gathered, "_Registers | None"]]:
    """Decode windows; those in the figures of plots have counts of registers."""
    for number, blocks in enumerate(windows):
        sources = sources_of(blocks)
        editions.detect(blocks, sources, revise=True)
        registers = _Registers(blocks.data) if number % every == 0 else None
        watch = None if registers is None else registers.add
        others = np.isin(blocks.data[blocks.begins], (SYSTEM_TRACKS, SENSOR_STATUS)).any()
        gathered = decode_blocks(
            blocks, sources, editions, watch=watch, measurements_only=not others,
            with_aircraft_data=registers is not None,
        )  # fmt: skip
        yield gathered, registers


def _ahead(items: Iterator[Item]) -> Iterator[Item]:
    """Yield items; the next one is made in another thread meanwhile."""
    with ThreadPoolExecutor(1) as pool:
        following = pool.submit(next, items, None)
        while (item := following.result()) is not None:
            following = pool.submit(next, items, None)
            yield item


class _Recording:
    """A file of which windows are added in order."""

    def __init__(
        self, survey: Survey, account: FileSurvey, all_times: Callable[[], Iterator[FileTimes]]
    ) -> None:
        self._survey = survey
        self._account = account
        self._all_times = all_times
        self._days = _Days()
        # Time of the day on which the file starts, s; None before its first times.
        self._moved_s: float | None = None
        # Whether all times were compared with those of other files.
        self._compared = False
        survey.files.append(account)

    def add(self, gathered: Gathered, registers: "_Registers | None") -> None:
        """Add the content of a window."""
        self._count(gathered)
        timed, antennas = time_targets(gathered)
        if registers is not None:
            self._survey.differences += _differences(gathered, timed)
        self._survey.references = reported_references(antennas) | self._survey.references
        for source, one in antennas.items():
            before = self._survey.antennas.get(source_name(source))
            site = one.site or (before.site if before is not None else None)
            if before is None or (one.north_marks, one.sectors) > (
                before.north_marks,
                before.sectors,
            ):
                before = Antenna(one.north_marks, one.sectors, one.period_s, site)
            self._survey.antennas[source_name(source)] = replace(before, site=site)
        days = self._dated(gathered, timed)
        if self._survey.start_s is None and timed is not None:
            self._survey.start_s = _day_start(timed.rows.received_s, days.time_s)
        if gathered.status:
            reported = reported_biases.frame(gathered.status, days.status_s, 0.0)
            self._survey.reported.append(reported)
        if timed is not None:
            self._add_reports(timed, days, detailed=registers is not None)
        for source, counts in registers.counts.items() if registers else ():
            self._survey.sensor((source_name(source), KINDS[0])).registers.update(counts)

    def _count(self, gathered: Gathered) -> None:
        account = self._account
        account.size += gathered.blocks.size
        account.octets.update(gathered.octets)
        account.read += sum(gathered.records.values()) + len(gathered.broken)
        account.rejected += len(gathered.broken)
        for broken in gathered.broken:
            account.reasons[str(broken.code), _PLACE.sub("", broken.reason)] += 1
        for (category, source), count in gathered.records.items():
            self._survey.category(category, source_name(source)).records += count
        for _, part in gathered.tracks:
            self._survey.system_tracks += part.height
            for wrong, code, reason in impossible_tracks(part):
                self._reject(int(wrong.sum()), str(code), reason)

    def _reject(self, count: int, code: str, reason: str) -> None:
        self._account.rejected += count
        if count:
            self._account.reasons[code, reason] += count

    def _add_reports(self, timed: Timed, days: FileDays, *, detailed: bool) -> None:
        time_s, kept = days.time_s, days.kept
        known = ~np.isnan(time_s)
        local = local_only(timed.targets)
        targets = located(timed.targets, timed.rows.source, self._survey.references)
        timed = replace(timed, targets=targets)
        measured, _, _ = aircraft(timed, all_targets=False)
        own = kept & measured
        far_off: Rejection = (known & ~kept, RejectCode.OUT_OF_RANGE, FAR_OFF)
        for wrong, code, reason in (
            *untimed(timed), far_off, unreferenced(timed, own), misplaced(timed, own)
        ):  # fmt: skip
            self._reject(int(wrong.sum()), str(code), reason)
            own = own & ~wrong
        places = np.flatnonzero(own)
        again = repeated(timed.same[places], timed.rows.source[places], time_s[places])
        self._account.duplicates += int(again.sum())
        own[places[again]] = False
        pairs = timed.rows.source * len(KINDS) + timed.kind
        for pair in distinct(pairs).tolist():
            rows = np.flatnonzero(pairs == pair)
            figures = self._survey.sensor(
                (source_name(pair // len(KINDS)), KINDS[pair % len(KINDS)])
            )
            figures.reports += len(rows)
            figures.duplicates += int((pairs[places[again]] == pair).sum())
            figures.left_out.update(_left_out(timed, rows))
            figures.local += int(local[rows].sum())
            figures.unreferenced += int(local_only(targets)[rows].sum())
            figures.add_times(time_s[rows[kept[rows]]])
            if detailed:
                figures.add(_reports(timed, rows[own[rows]], time_s))

    def _dated(self, gathered: Gathered, timed: Timed | None) -> FileDays:
        """Return the times of a window in the recording of all files."""
        days, order = self._days.add(gathered, timed), self._survey.order
        times = file_times(gathered, timed, days)
        if self._moved_s is None and len(times.time_s):
            self._compared = order.needs_all(times)
            whole = self._all_times() if self._compared else [times]
            self._moved_s = order.add(self._account.file, whole)
        elif not self._compared:
            order.extend(times)
        return days.moved(self._moved_s or 0.0)


class _Days:
    """Continues the times of a file from window to window."""

    def __init__(self) -> None:
        self._last_s = math.nan

    def add(self, gathered: Gathered, timed: Timed | None) -> FileDays:
        """Return the times of the next window."""
        days = days_of_file(gathered, timed)
        known_s = days.known_s
        if not len(known_s):
            return days
        if not math.isnan(self._last_s):
            days = days.moved(_DAY_S * round((self._last_s - float(known_s[0])) / _DAY_S))
        self._last_s = float(days.known_s.max())
        return days


def _reports(timed: Timed, own: Integers, time_s: Numbers) -> Reports:
    targets = timed.targets
    return Reports(
        time_s=time_s[own],
        range_m=targets.range_m[own],
        azimuth_deg=targets.azimuth_deg[own],
        latitude_deg=targets.latitude_deg[own],
        longitude_deg=targets.longitude_deg[own],
        height_m=targets.height_m[own],
        code=targets.code[own],
        address=targets.address[own],
        on_ground=targets.flags[own] & flag_bits("on_ground") != 0,
        aircraft_data=targets.aircraft_data[own],
        dropped=targets.dropped[own],
    )


def _left_out(timed: Timed, own: Integers) -> Counter[str]:
    """Count reports that are no measurements of aircraft, by reason."""
    targets = timed.targets
    placed = (has_position(timed) | local_only(targets))[own]
    counts = Counter(no_position=int((~placed).sum()))
    for name in NOT_AIRCRAFT:
        marked = placed & (targets.flags[own] & flag_bits(name) != 0)
        counts[name] = int(marked.sum())
        placed &= ~marked
    return +counts


def _differences(gathered: Gathered, timed: Timed | None) -> list[Differences]:
    """Return how much later some messages of a window were received than their times."""
    rows, services = services_in_order(gathered)
    found = [of_services(rows.source, services, rows.received_s)]
    found += [] if timed is None else [of_reports(timed)]
    return [_thinned(one) for one in found if len(one.source)]


def _thinned(found: Differences) -> Differences:
    step = len(found.source) // DIFFERENCES_MAX + 1
    return Differences(found.source[::step], found.delay_s[::step], found.report[::step])


def _day_start(received_s: Numbers, time_s: Numbers) -> float | None:
    """Return the Unix time of the start of the day of the first time, if the recorder knows it."""
    apart = (received_s - time_s)[np.isfinite(received_s) & np.isfinite(time_s)]
    if not len(apart) or np.median(apart) < DATED_FROM_S:
        return None
    return _DAY_S * round(float(np.median(apart)) / _DAY_S)


class _Registers:
    """Counts BDS registers by source."""

    def __init__(self, data: Octets) -> None:
        self.counts: dict[int, Counter[str]] = {}
        self._data = data

    def add(self, walked: Walked, rows: Rows) -> None:
        """Count the registers of records."""
        program = walked.program
        if program.layout.category != _BDS_CATEGORY or _BDS_ITEM not in program.places:
            return
        begins = walked.starts[:, program.places[_BDS_ITEM]]
        for source in distinct(rows.source).tolist():
            counts = self.counts.setdefault(source, Counter())
            counts.update(_registers(self._data, begins[rows.source == source]))


def _registers(data: Octets, begins: NDArray[np.int32]) -> Counter[str]:
    own = begins[begins >= 0].astype(np.int64)
    counts: Counter[str] = Counter(any=len(own))
    number = data[own].astype(np.int64)
    for k in range(int(number.max(initial=0))):
        last = data[own[number > k] + _BDS_OCTETS * (k + 1)]
        for register, count in enumerate(np.bincount(last, minlength=256).tolist()):
            if count:
                counts[f"{register >> 4:X},{register & 15:X}"] += count
    return counts
