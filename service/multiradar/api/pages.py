"""The pages that show the air picture now: who is connected."""

import threading
from collections import Counter, OrderedDict
from collections.abc import Callable

#: A page that has not asked for a picture for so long is closed, s; it asks every half second.
OPEN_S = 10.0
#: Pages that are counted at most.
PAGES_MAX = 1024
#: Header with which a page names itself, at random; characters that count.
PAGE_HEADER = "x-multiradar-page"
NAME_LENGTH_MAX = 32


class Pages:
    """The pages that ask for pictures; for any thread.

    Parameters
    ----------
    monotonic_s : callable
        Returns the time, s.
    """

    def __init__(self, monotonic_s: Callable[[], float]) -> None:
        self._monotonic_s = monotonic_s
        self._lock = threading.Lock()
        # When each asked last, by client and name; the longest ago comes first.
        self._asked_s: OrderedDict[tuple[str, str], float] = OrderedDict()

    def note(self, client: str, name: str | None) -> None:
        """Note that a page asked for a picture; a program without a name is no page.

        Parameters
        ----------
        client : str
            Name of its credentials, or its address.
        name : str or None
            As the page gave it.
        """
        if name is None:
            return
        page = client, name[:NAME_LENGTH_MAX]
        with self._lock:
            self._asked_s[page] = self._monotonic_s()
            self._asked_s.move_to_end(page)
            while len(self._asked_s) > PAGES_MAX:
                self._asked_s.popitem(last=False)

    def connected(self) -> dict[str, int]:
        """Return the number of open pages of each client, by client."""
        since_s = self._monotonic_s() - OPEN_S
        with self._lock:
            while self._asked_s and next(iter(self._asked_s.values())) < since_s:
                self._asked_s.popitem(last=False)
            counts = Counter(client for client, _ in self._asked_s)
        return dict(sorted(counts.items()))
