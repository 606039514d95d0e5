"""The receipt of a message once it is in the journal."""

import json
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass

from multiradar.storage.entries import RejectedRow
from multiradar.storage.sqlite.chain import json_array

__all__ = [
    "IDEMPOTENCY_KEY_FORM",
    "IDEMPOTENCY_KEY_LENGTH_MAX",
    "SENDER_SEPARATOR",
    "Receipt",
    "RejectedRow",
    "is_idempotency_key",
    "key_of_sender",
    "once_processed",
    "receipt_json",
]

IDEMPOTENCY_KEY_LENGTH_MAX = 128
#: Between the name of a sender and its key.
SENDER_SEPARATOR = "\x1f"
#: The form of an idempotency key, for error messages.
IDEMPOTENCY_KEY_FORM = (
    f"1 to {IDEMPOTENCY_KEY_LENGTH_MAX} printable ASCII characters without a space at either end"
)

#: Called when a message was executed.
Executed = Callable[[], None]


@dataclass(frozen=True, slots=True)
class Receipt:
    """The answer to one message: all its rows are accounted for, and on disk.

    Attributes
    ----------
    accepted : int
        Rows in the journal.
    rejected : tuple of RejectedRow
        Rejected rows, by ascending index; they are in the quarantine.
    duplicate : bool
        True when a message with the same idempotency key was accepted before; the other fields
        are those of its receipt.
    journal_sequence : int
        Journal entry of the message.
    """

    accepted: int
    rejected: tuple[RejectedRow, ...]
    duplicate: bool
    journal_sequence: int


def receipt_json(receipt: Receipt) -> bytes:
    """Return the JSON document of a receipt, the same for all interfaces."""
    rejected = json_array(
        {"index": row.index, "code": row.code, "reason": row.reason} for row in receipt.rejected
    )
    rest = json.dumps(
        {"duplicate": receipt.duplicate, "journal_sequence": receipt.journal_sequence}
    )
    return f'{{"accepted": {receipt.accepted}, "rejected": {rejected}, {rest[1:]}'.encode()


def is_idempotency_key(text: str) -> bool:
    """Return whether a text is a valid idempotency key: `IDEMPOTENCY_KEY_FORM`."""
    return (
        0 < len(text) <= IDEMPOTENCY_KEY_LENGTH_MAX
        and text.isascii()
        and text.isprintable()
        and text == text.strip()
    )


def key_of_sender(sender: str, key: str | None) -> str | None:
    """Return a key as the journal keeps it: apart from the same key of another sender.

    A sender without a name, of a service without credentials, shares its keys with all such.
    """
    # No valid key has the separator.
    return f"{sender}{SENDER_SEPARATOR}{key}" if sender and key is not None else key


def once_executed(future: Future[Receipt], then: Executed) -> Future[Receipt]:
    """Call a function when a message was executed: without an error, and not already before.

    Parameters
    ----------
    future : Future of Receipt
        That of the message.
    then : callable
        Called in the thread that resolves the future, also after the deadline of its request.

    Returns
    -------
    Future of Receipt
        The same one.
    """

    def settled(done: Future[Receipt]) -> None:
        if not (done.cancelled() or done.exception() is not None or done.result().duplicate):
            then()

    future.add_done_callback(settled)
    return future


def once_processed(
    journalled: Future[Receipt],
    settled: Callable[[int], Future[int]],
    then: Executed | None = None,
) -> Future[Receipt]:
    """Return a future of the same receipt, resolved once its entry is processed.

    It cannot be cancelled: the engine resolves it.

    Parameters
    ----------
    journalled : Future of Receipt
        Resolved when the message is in the journal.
    settled : callable
        Returns a future that is resolved when an entry has been processed.
    then : callable, optional
        Called as by `once_executed`, before the entry is processed.
    """
    if then is not None:
        once_executed(journalled, then)
    answer: Future[Receipt] = Future()
    answer.set_running_or_notify_cancel()

    def on_disk(done: Future[Receipt]) -> None:
        error = done.exception()
        if error is not None:
            answer.set_exception(error)
            return
        receipt = done.result()
        processed = settled(receipt.journal_sequence)
        processed.add_done_callback(lambda done: readable(done, receipt))

    def readable(done: Future[int], receipt: Receipt) -> None:
        error = done.exception()
        if error is not None:
            answer.set_exception(error)
        else:
            answer.set_result(receipt)

    journalled.add_done_callback(on_disk)
    return answer
