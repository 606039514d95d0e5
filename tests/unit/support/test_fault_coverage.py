"""What the simulator requires of its runs: faults in effect, and no datagram lost silently."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from multiradar.ingest.asterix_counts import AsterixCounts
from support.simulation import __main__ as command
from support.simulation.datagrams import DatagramRecord
from support.simulation.faults import FAULTS
from support.simulation.process import PORT, Delivered, Process
from support.simulation.record import Violation
from support.simulation.run import Outcome

NAMES = [fault.name for fault in FAULTS]
OCTETS = 100


def outcome(runs: int, *without: str) -> Outcome:
    """Return runs that drew all faults; some never took effect."""
    made = Outcome(runs=runs)
    made.drawn.update(dict.fromkeys(NAMES, runs))
    made.cover(0, set(NAMES) - set(without))
    return made


@pytest.mark.parametrize(
    ("runs", "without", "given", "status"),
    [
        (command.RUNS_OF_ALL, (), (), 0),
        (command.RUNS_OF_ALL, NAMES[:1], (), 1),
        (command.RUNS_OF_ALL - 1, NAMES[:1], (), 0),
        (command.RUNS_OF_GIVEN, NAMES[:1], NAMES[:1], 1),
        (command.RUNS_OF_GIVEN, NAMES[:1], NAMES[1:2], 0),
        (command.RUNS_OF_GIVEN - 1, NAMES[:1], NAMES[:1], 0),
    ],
)
def test_a_fault_without_effect_in_enough_runs_is_a_failure(
    monkeypatch: pytest.MonkeyPatch,
    runs: int,
    without: tuple[str, ...],
    given: tuple[str, ...],
    status: int,
) -> None:
    monkeypatch.setattr(command, "_outcomes", lambda _: iter([outcome(runs, *without)]))
    options = [part for name in given for part in ("--fault", name)]
    assert command.main(["--runs", str(runs), *options]) == status


def test_faults_that_were_drawn_but_had_no_effect_are_not_covered() -> None:
    row = FAULTS[0].row
    own = [fault.name for fault in FAULTS if fault.row == row]
    text = command.summary(outcome(5, *own), 1.0)
    assert f"in effect: faults {len(FAULTS) - len(own)} of {len(FAULTS)}; " in text
    assert "rows of the fault model 39 of 40 " in text
    assert "pairs of rows 741 of 780, the rarest 0 times" in text


def process(
    plots: int = 4,
    *,
    damaged: bool = False,
    disk_full: bool = False,
    before: int = 0,
    **counted: int,
) -> Process:
    """Return a process that got two datagrams, by default all accepted; and what it counts.

    `before` them, it got damaged ones without octets.
    """
    delivered = Delivered()
    for _ in range(before):
        delivered.add(0, None)
    delivered.add(OCTETS, plots)
    delivered.add(OCTETS, None if damaged else 0)
    counts = AsterixCounts((PORT,))
    waiting = counted.pop("waiting", 0)
    counts.waiting = lambda: (waiting, waiting * OCTETS)
    whole = {
        "datagrams": 2, "octets": 2 * OCTETS, "octets_decoded": 2 * OCTETS,
        "records_measurement": 4, "rows_accepted": 4,
    }  # fmt: skip
    counts.add(0, **(whole | counted))
    view = SimpleNamespace(edge_counts={"asterix": counts.document})
    disk = SimpleNamespace(faulted={"full"} if disk_full else set(), dead=False)
    fake = SimpleNamespace(delivered=delivered, disk=disk, service=SimpleNamespace(view=view))
    return cast(Process, fake)


def entries(rows: int) -> list[tuple[Any, ...]]:
    """Return a journal with rows of datagrams, and others."""
    return [
        (1, "batch", "asterix/north", None, b"", rows, b"", b""),
        (2, "batch", "alpha", "key", b"", 7, b"", b""),
        (3, "flush", "asterix/north", None, b"", 0, b"", b""),
    ]


@pytest.mark.parametrize(
    "fine",
    [
        {},
        {"octets_decoded": OCTETS, "octets_dropped": OCTETS, "datagrams_dropped": 1},
        {"octets_decoded": OCTETS, "waiting": 1, "records_measurement": 2, "rows_accepted": 1},
        {"rows_accepted": 1, "rows_rejected": 1},
        {"disk_full": True, "rows_accepted": 1, "rows_lost": 3},
        {
            "records_measurement": 1,
            "records_duplicate": 1,
            "records_left_out": 1,
            "rows_accepted": 1,
        }
        | {"records_refused": 1},
        {"damaged": True, "records_measurement": 5},
        # Of a source that matches no edition, intact ones are rejected as well.
        {"before": 3, "datagrams": 5, "records_measurement": 0, "rows_accepted": 0},
    ],
)
def test_datagrams_that_are_counted_pass(fine: dict[str, Any]) -> None:
    DatagramRecord().check(process(**fine))


@pytest.mark.parametrize(
    ("lost", "how"),
    [
        ({"datagrams": 1, "octets": OCTETS}, "received"),
        ({"octets_decoded": OCTETS}, "200 octets of datagrams"),
        ({"octets_decoded": 3 * OCTETS}, "200 octets of datagrams"),
        ({"records_measurement": 3, "rows_accepted": 3}, "3 records"),
        ({"records_measurement": 5}, "5 records"),
        ({"damaged": True, "records_measurement": 3, "rows_accepted": 3}, "3 records"),
        ({"before": 2, "datagrams": 4, "records_measurement": 3, "rows_accepted": 3}, "3 records"),
        ({"rows_accepted": 5}, "rows of datagrams"),
        ({"rows_accepted": 3, "rows_lost": 1}, "1 rows lost"),
    ],
)
def test_a_datagram_that_is_not_counted_is_found(lost: dict[str, Any], how: str) -> None:
    with pytest.raises(Violation, match=f"I1: .*{how}"):
        DatagramRecord().check(process(**lost))


def test_rows_shown_as_accepted_are_in_the_journal() -> None:
    record = DatagramRecord()
    record.ended(process(), in_order=True)
    record.check_journal(entries(4))
    for wrong in (3, 5):
        with pytest.raises(Violation, match=f"I1: {wrong} rows of datagrams in the journal"):
            record.check_journal(entries(wrong))


def test_what_a_process_that_dies_has_not_answered_may_be_in_the_journal() -> None:
    record = DatagramRecord()
    record.ended(process(rows_accepted=1, rows_lost=1), in_order=False)
    record.check_journal(entries(1))
    record.check_journal(entries(4))
    with pytest.raises(Violation, match="accepted 1 to 4"):
        record.check_journal(entries(0))
    record.migrated()
    record.check_journal(entries(0))


@pytest.mark.parametrize("left", [{"rows_accepted": 3}, {"waiting": 1, "octets_decoded": OCTETS}])
def test_a_process_that_ends_in_order_has_no_work_left(left: dict[str, Any]) -> None:
    with pytest.raises(Violation, match="I1: rows and datagrams left at the end"):
        DatagramRecord().ended(process(**left), in_order=True)
