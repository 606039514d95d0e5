"""Which region is responsible for an aircraft that two or more of them track.

Each region decides alone, from its own track and what the others say about theirs. A region that
is responsible says since when; of two that are, the later one stays, so that both come to the same
result however the messages cross. A region takes over before the other gives up: an aircraft is
without a responsible region only if that fails, for as long as its silence takes to be noticed.
"""

from collections.abc import Sequence
from typing import NamedTuple

#: A later time than that of another region, s.
LATER_S = 1e-3


class Claim(NamedTuple):
    """What a neighbour says about its track of an aircraft.

    Attributes
    ----------
    since_s : float
        Data time since which it is responsible, s.
    region : str
        Its name.
    track : bytes
        Its track, as REGION/NUMBER.
    aircraft : bytes
        Name of the aircraft.
    fresh : bool
        Whether the track is confirmed and was updated lately.
    hears : bool
        Whether the neighbour has recent messages of this region.
    """

    since_s: float
    region: str
    track: bytes
    aircraft: bytes
    fresh: bool
    hears: bool


class Position(NamedTuple):
    """The own side.

    Attributes
    ----------
    region : str
        Name of this region.
    responsible : bool
        Whether it is responsible.
    since_s : float
        Since when, s.
    inside : bool
        Whether the aircraft is in its area, farther from the boundary than the hysteresis.
    able : bool
        Whether the own track is confirmed and was updated lately.
    waits : bool
        Whether the track is new and in the area of a neighbour, which may have one, too.
    """

    region: str
    responsible: bool
    since_s: float
    inside: bool
    able: bool
    waits: bool = False


class Decision(NamedTuple):
    """What becomes of the own track.

    Attributes
    ----------
    responsible : bool
        Whether this region is responsible.
    since_s : float
        Since when, s.
    follows : Claim or None
        The neighbour that is, or was until now: the aircraft has its name.
    """

    responsible: bool
    since_s: float
    follows: Claim | None


def decide(own: Position, claims: Sequence[Claim], now_s: float) -> Decision:
    """Decide whether this region is responsible.

    Parameters
    ----------
    own : Position
        The own side.
    claims : sequence of Claim
        Neighbours that say they are responsible; not those that are silent.
    now_s : float
        Data time, s.
    """
    if not claims:
        if own.responsible:
            return Decision(True, own.since_s, None)
        return Decision(not own.waits, now_s, None)
    best = max(claims, key=lambda one: (one.since_s, one.region))
    later_s = max(now_s, best.since_s + LATER_S)
    takes = own.able and (own.inside or not best.fresh)
    if not best.hears:
        # It would not give up.
        return Decision(False, own.since_s, best)
    if not own.responsible:
        return Decision(True, later_s, best) if takes else Decision(False, own.since_s, best)
    if (own.since_s, own.region) > (best.since_s, best.region):
        return Decision(True, own.since_s, None)
    # Both are. Only one of them has the aircraft inside its area.
    return Decision(True, later_s, None) if takes else Decision(False, own.since_s, best)
