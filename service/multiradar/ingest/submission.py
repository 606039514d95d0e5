"""Submission to the journal by receivers that no sender would repeat."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future

import polars as pl

from multiradar.errors import QueueFullError
from multiradar.runtime.live.receipt import Receipt, RejectedRow
from multiradar.runtime.ports import MeasurementSink

#: Retries of a batch while the journal queue is full; then its rows are lost.
SUBMIT_RETRIES_MAX = 60


def submit_when_possible(
    sink: MeasurementSink,
    frame: pl.DataFrame,
    rejected: Sequence[RejectedRow],
    source: str,
    wait: Callable[[float], bool],
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
    wait : callable
        Waits for a time, s; returns whether the receiver is stopping.

    Returns
    -------
    Future of Receipt
        Resolved when they are on disk.

    Raises
    ------
    QueueFullError
        The queue stayed full.
    MultiradarError
        The service accepts nothing.
    """
    for left in range(SUBMIT_RETRIES_MAX, -1, -1):
        try:
            return sink.submit(frame, source=source, rejected=rejected)
        except QueueFullError as error:
            # Meanwhile data wait at the receiver; those that do not fit there are counted.
            if not left or wait(error.retry_after_s):
                raise
    msg = "unreachable"
    raise AssertionError(msg)
