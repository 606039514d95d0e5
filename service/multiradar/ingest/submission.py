"""Submission to the journal by receivers that no sender would repeat."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future, wait
from itertools import count

import polars as pl

from multiradar.errors import (
    JournalBusyError,
    JournalFullError,
    QuarantineError,
    QueueFullError,
)
from multiradar.runtime.live.receipt import Receipt, RejectedRow
from multiradar.runtime.ports import MeasurementSink

#: Retries of a batch while the journal queue is full; then its rows are lost.
SUBMIT_RETRIES_MAX = 60
#: Pause before a patient receiver tries a full disk again, s.
DISK_PAUSE_S = 1.0
# A patient receiver looks so often whether it is stopping, s.
_POLL_S = 0.2


def submit_when_possible(
    sink: MeasurementSink,
    frame: pl.DataFrame,
    rejected: Sequence[RejectedRow],
    source: str,
    pause: Callable[[float], bool],
    *,
    patient: bool = False,
    shared: bool = False,
) -> Future[Receipt]:
    """Submit measurements; retry while the journal queue is full.

    Parameters
    ----------
    sink : MeasurementSink
        The running service.
    frame : DataFrame
        The measurements.
    rejected : sequence of RejectedRow
        Rows for the quarantine.
    source : str
        The sender.
    pause : callable
        Waits for a time, s; returns whether the receiver is stopping.
    patient : bool
        Whether further data can wait at their sender: then it retries until the measurements are on
        disk or the receiver stops, also while the disk is full or the journal is locked.
    shared : bool
        Whether the receiver serves other sources, too: then it does not wait for one in quarantine.

    Returns
    -------
    Future of Receipt
        Resolved when they are on disk.

    Raises
    ------
    QueueFullError
        The queue stayed full, or the source of a shared receiver is in quarantine.
    MultiradarError
        The service accepts nothing.
    """
    for retries in count():
        try:
            future = sink.submit(frame, source=source, rejected=rejected)
        except QueueFullError as error:
            # Meanwhile data wait at the receiver; those that do not fit there are counted.
            quarantined = isinstance(error, QuarantineError)
            if shared and quarantined:
                raise
            endless = patient and not quarantined
            if (retries >= SUBMIT_RETRIES_MAX and not endless) or pause(error.retry_after_s):
                raise
            continue
        if not (patient and _is_not_written_yet(future, pause)) or pause(DISK_PAUSE_S):
            return future
    msg = "unreachable"
    raise AssertionError(msg)


# Whether the disk is full or the journal locked; waits for the journal, unless the receiver is
# stopping.
def _is_not_written_yet(future: Future[Receipt], pause: Callable[[float], bool]) -> bool:
    while not wait([future], _POLL_S).done:
        if pause(0.0):
            return False
    return isinstance(future.exception(), JournalFullError | JournalBusyError)
