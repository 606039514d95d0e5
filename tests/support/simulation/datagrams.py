"""What became of each datagram: counted by the service that received it, or in the journal."""

from collections.abc import Sequence
from typing import Any

from multiradar.ingest.asterix_inlet import SOURCE
from support.simulation.process import PORT, Process
from support.simulation.record import require

_OCTETS = ("dropped", "framing", "decoded", "skipped", "quarantined")
_RECORDS = ("measurement", "duplicate", "left_out", "refused")


class DatagramRecord:
    """Compares the datagrams of a run with the counters of its processes, and with the journal."""

    def __init__(self) -> None:
        # Rows of all processes that have ended: those that must be in the journal, and may be.
        self._least = self._most = 0

    def check(self, process: Process) -> None:
        """Check the counters of a process, which may be at work."""
        counts, own = _counts(process)
        delivered = process.delivered
        found = own["datagrams"], own["octets"]
        wanted = delivered.datagrams, delivered.octets
        require(found == wanted, "I1", f"datagrams and octets: received {found}, sent {wanted}")
        parts = {name: own[f"octets_{name}"] for name in _OCTETS}
        parts |= {name: counts[f"{name}_octets"] for name in ("waiting", "decoding")}
        require(
            delivered.octets == sum(parts.values()), "I1",
            f"{delivered.octets} octets of datagrams: {parts}",
        )  # fmt: skip
        require(_on_their_way(own) >= 0, "I1", f"rows of datagrams: {own}")
        lost = own["rows_lost"]
        # To what is left of a process that was killed, each call of the disk fails.
        faulty = process.disk.dead or bool(process.disk.faulted)
        require(not lost or faulty, "I1", f"{lost} rows lost without a fault")
        if not counts["waiting_datagrams"] and not delivered.unlike:
            records = sum(own[f"records_{name}"] for name in _RECORDS)
            same = records == delivered.plots if delivered.intact else records >= delivered.plots
            require(same, "I1", f"{records} records of datagrams with {delivered.plots} plots")

    def ended(self, process: Process, *, in_order: bool) -> None:
        """Note what a process that has ended counted; one that ended in order has no work left."""
        counts, own = _counts(process)
        rest, accepted = _on_their_way(own), own["rows_accepted"]
        self._least += accepted
        self._most += accepted
        if in_order:
            self.check(process)
            left = rest, counts["waiting_datagrams"]
            require(left == (0, 0), "I1", f"rows and datagrams left at the end: {left}")
        else:
            # A transaction that failed, or was not answered, may be on the disk.
            self._most += rest + own["rows_lost"]

    def migrated(self) -> None:
        """Note that the journal was migrated to other sensors, which may reject any row."""
        self._least = 0

    def check_journal(self, entries: Sequence[tuple[Any, ...]]) -> None:
        """Compare the rows that the services have shown as accepted with those in the journal."""
        found = sum(
            entry[5]
            for entry in entries
            if entry[1] == "batch" and entry[2].startswith(f"{SOURCE}/")
        )
        require(
            self._least <= found <= self._most, "I1",
            f"{found} rows of datagrams in the journal, accepted {self._least} to {self._most}",
        )  # fmt: skip


def _counts(process: Process) -> tuple[dict[str, Any], dict[str, Any]]:
    # As the status shows them.
    counts = process.service.view.edge_counts["asterix"]()
    return counts, counts["listeners"][PORT]


def _on_their_way(own: dict[str, Any]) -> int:
    settled = sum(own[f"rows_{name}"] for name in ("accepted", "rejected", "lost"))
    return int(own["records_measurement"] - settled)
