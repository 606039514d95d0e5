"""Ages of values that readsb repeats until the next one, for a minute, without saying so.

Roll, airspeeds and heading are replies to interrogations by radars every few seconds, if at all. A
value that repeats may be as old as the last turn. Values of one register arrive together, and in
flight at least one of them differs nearly always. So a register is as old as its last change at
most: it arrived after the message before that change.
"""

from dataclasses import dataclass, field

from multiradar_converters.adsb.reading import roles
from multiradar_converters.feeds.aircraft import Aircraft

#: Maximum age, s; as for other sources of such data.
AGE_MAX_S = 3.0

#: Values that arrive together: registers 5,0 and 6,0.
_REGISTERS = (
    (roles.ROLL, roles.TURN, roles.TRUE_AIRSPEED),
    (roles.HEADING, roles.INDICATED, roles.MACH),
)


@dataclass
class _Registers:
    """Time of the last message, the last values of each register, and when it is known to be newer.

    Before any message the values are of unknown age.
    """

    time_s: float = float("-inf")
    values: dict[int, tuple[str, ...]] = field(default_factory=dict)
    since_s: dict[int, float] = field(default_factory=dict)


class RegisterAges:
    """Omits values of registers that may be older than `AGE_MAX_S`."""

    def __init__(self) -> None:
        self._aircraft = Aircraft(_Registers)

    def omit_old(self, cells: dict[int, str], address: int, time_s: float) -> bool:
        """Omit old values.

        Parameters
        ----------
        cells : dict of int to str
            Text of a message by role; changed in place.
        address : int
            Its aircraft.
        time_s : float
            Its time, s.

        Returns
        -------
        bool
            Whether any value was omitted.
        """
        known = self._aircraft.of(address, time_s)
        omitted = False
        for number, members in enumerate(_REGISTERS):
            values = tuple(cells.get(role, "") for role in members)
            if not any(values):
                continue
            if values != known.values.get(number):
                known.values[number], known.since_s[number] = values, known.time_s
            # Written so that an infinite age is old.
            if not time_s - known.since_s[number] <= AGE_MAX_S:
                omitted = True
                for role in members:
                    cells.pop(role, None)
        known.time_s = time_s
        return omitted
