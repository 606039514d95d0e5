"""Wrong credentials by client: too many of them are asked to pause.

Right credentials are valid also at an address that sends wrong ones. A wrong key
costs one digest, whether it is the first or the millionth.
"""

from collections import OrderedDict

from multiradar.clock import Clock
from multiradar.errors import RequestError

#: Wrong credentials of a client within this time, s, before it is asked to pause.
WRONG_MAX = 100
WITHIN_S = 60.0
#: Clients retained; the oldest are discarded first.
RETAINED_MAX = 4096


class Attempts:
    """Counts wrong credentials. Used on one thread.

    Parameters
    ----------
    clock : Clock
        Monotonic time.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._wrong: OrderedDict[str, tuple[float, int]] = OrderedDict()

    def note_wrong(self, client: str) -> None:
        """Count wrong credentials of a client.

        Raises
        ------
        RequestError
            429 after too many.
        """
        now_s = self._clock.monotonic_s()
        since_s, count = self._wrong.pop(client, (now_s, 0))
        if now_s - since_s >= WITHIN_S:
            since_s, count = now_s, 0
        self._wrong[client] = since_s, count + 1
        while len(self._wrong) > RETAINED_MAX:
            self._wrong.popitem(last=False)
        if count >= WRONG_MAX:
            pause_s = int(WITHIN_S - (now_s - since_s)) + 1
            raise RequestError(
                429,
                "TOO_MANY_ATTEMPTS",
                f"{count} invalid keys or tokens within {WITHIN_S:g} s; correct the key of this "
                "client and try again later",
                {"retry-after": str(pause_s)},
            )
