"""Tracks of this region and of its neighbours, and which region is responsible for each aircraft.

The board depends on the journal alone: it gets the output of the engine and, as entries of the
journal, the messages of the neighbours. It decides at each message, at each new track, and in steps
of data time, so that the size of batches has no influence.
"""

import threading
from collections.abc import Iterable
from typing import Any, ClassVar, NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.errors import InputError
from multiradar.runtime.memory.regions.areas import Areas
from multiradar.runtime.memory.regions.matching import match
from multiradar.runtime.memory.regions.messages import other_rows, read_handover, unpacked
from multiradar.runtime.memory.regions.responsibility import Claim, Position, decide
from multiradar.runtime.memory.regions.rows import (
    OTHER_DTYPE,
    OWN_DTYPE,
    marks_of,
    own_rows,
)
from multiradar.runtime.stream.region_marks import MARK_DTYPE, reference
from multiradar.state import Fields
from multiradar.tracking.outputs import EndedTracks, EngineOutput, TrackUpdates

#: Step of data time after which responsibility is decided again, s.
STEP_S = 1.0
#: Fields of a row that decisions and matches set; updates of the track leave them.
_DECIDED = ("responsible", "since_s", "aircraft", "duplicate_of", "first_s")


class RegionRules(NamedTuple):
    """When a region takes over; see the section `region` of the settings."""

    margin_m: float = 50_000.0
    hysteresis_m: float = 2_000.0
    silence_s: float = 3.0
    discard_after_s: float = 60.0
    coast_after_s: float = 12.0


class Neighbour:
    """What a neighbour has handed over."""

    STATE: ClassVar[Fields] = {
        "rows": np.ndarray, "heard_s": float, "sent_s": float, "messages": int, "biases": list[str],
        "hears": bool,
    }  # fmt: skip

    def __init__(self) -> None:
        #: Its tracks, rows of `OTHER_DTYPE`.
        self.rows: NDArray[np.void] = np.zeros(0, OTHER_DTYPE)
        #: Own data time at the first update after its last message, s: inf until there is one.
        #: Its own data time in that message, s. Both are -inf before any message.
        self.heard_s = self.sent_s = -np.inf
        self.messages = 0
        #: Whether it had recent messages of this region.
        self.hears = False
        #: Its biases, JSON.
        self.biases: list[str] = []


class RegionBoard:
    """The board; the engine's thread writes, any thread reads.

    Parameters
    ----------
    areas : Areas
        The regions.
    rules : RegionRules
        When a region takes over.
    """

    STATE: ClassVar[Fields] = {
        "_own": np.ndarray, "_neighbours": dict[str, Neighbour], "_reached_s": float,
        "_step": float, "takeovers": int, "unusable": int,
    }  # fmt: skip

    def __init__(self, areas: Areas, rules: RegionRules) -> None:
        self.areas = areas
        self.rules = rules
        self._lock = threading.Lock()
        self.clear()

    @property
    def name(self) -> str:
        """Name of this region."""
        return self.areas.own.name

    def clear(self) -> None:
        """Discard everything: the journal is replayed from the start."""
        with self._lock:
            self._own: NDArray[np.void] = np.zeros(0, OWN_DTYPE)
            self._neighbours = {name: Neighbour() for name in self.areas.neighbours}
            self._reached_s, self._step = -np.inf, -np.inf
            #: Aircraft taken over from neighbours, and messages of the journal without use.
            self.takeovers = self.unusable = 0

    def restored(self) -> None:
        """Continue a snapshot, perhaps of other neighbours."""
        known = self._neighbours
        self._neighbours = {name: known.get(name) or Neighbour() for name in self.areas.neighbours}

    # ---------------------------------------------------------------- the engine's thread

    def absorb(self, output: EngineOutput) -> NDArray[np.void]:
        """Add output of the engine.

        Returns
        -------
        (n,) ndarray of `MARK_DTYPE`
            What subscribers get of each of its updates.
        """
        with self._lock:
            return self._absorb(output.updates, output.ended)

    def hand_over(self, payload: bytes) -> None:
        """Use a message of a neighbour, as it is journalled; one that is not valid is counted."""
        with self._lock:
            try:
                message = read_handover(unpacked(payload), self.areas)
            except InputError:
                # The settings were others when it was received.
                self.unusable += 1
                return
            one = self._neighbours[message.region]
            rows = other_rows(message)
            tracks: list[int] = one.rows["track_id"].tolist()
            own: list[int] = one.rows["own_id"].tolist()
            before = dict(zip(tracks, own, strict=True))
            rows["own_id"] = [before.get(track, 0) for track in rows["track_id"].tolist()]
            one.rows, one.heard_s, one.sent_s = rows, np.inf, message.time_s
            one.messages, one.hears = one.messages + 1, self.name in message.heard
            one.biases = [bias.model_dump_json() for bias in message.biases]
            match(self._own, one.rows)
            self._withdraw(one.rows)
            self._decide(np.arange(len(self._own)))

    def set_back(self) -> None:
        """Expect earlier times: all tracks were terminated."""
        with self._lock:
            self._own = self._own[:0]
            self._reached_s = self._step = -np.inf
            for one in self._neighbours.values():
                one.rows, one.sent_s = one.rows[:0], -np.inf
                one.heard_s = np.inf if one.messages else -np.inf

    # ---------------------------------------------------------------- readers

    def marks(self, track_ids: NDArray[np.int64]) -> NDArray[np.void]:
        """Return what subscribers get of tracks, rows of `MARK_DTYPE`; those unknown are empty."""
        marks = np.zeros(len(track_ids), MARK_DTYPE)
        with self._lock:
            places, known = self._find(track_ids)
            marks[known] = marks_of(self._own[places[known]])
        return marks

    def fields(self, track_ids: NDArray[np.int64]) -> pl.DataFrame:
        """Return what subscribers get of tracks, as columns of a table of tracks."""
        marks = self.marks(track_ids)
        texts = {
            name: pl.Series([one.decode() or None for one in marks[name].tolist()], dtype=pl.String)
            for name in ("duplicate_of", "continues")
        }
        return pl.DataFrame({
            "region": pl.Series([self.name] * len(marks), dtype=pl.String),
            "responsible": marks["responsible"],
            **texts,
        })  # fmt: skip

    def near(self) -> tuple[NDArray[np.void], float]:
        """Return the tracks to hand over, rows of `OWN_DTYPE`, and the time they reach, s."""
        with self._lock:
            own, reached_s = self._own.copy(), self._reached_s
            matched = [one.rows["own_id"] for one in self._neighbours.values()]
        near = self._depth_m(own) <= self.rules.margin_m
        near |= np.isin(own["track_id"], np.concatenate([np.empty(0, np.int64), *matched]))
        return own[near], reached_s

    def heard(self) -> list[str]:
        """Return the neighbours with recent messages."""
        with self._lock:
            return [name for name, one in self._neighbours.items() if self._is_alive(one)]

    def silent(self) -> list[str]:
        """Return the neighbours that have been heard and are silent."""
        with self._lock:
            return [name for name, one in self._neighbours.items() if self._is_silent(one)]

    def figures(self) -> dict[str, Any]:
        """Return counts of tracks, and of each neighbour its state and what it handed over."""
        with self._lock:
            responsible = int(self._own["responsible"].sum())
            return {
                "responsible": responsible,
                "duplicates": len(self._own) - responsible,
                "takeovers": self.takeovers,
                "unusable": self.unusable,
                "neighbours": [self._figures(name, one) for name, one in self._neighbours.items()],
            }

    def biases(self, region: str) -> list[str]:
        """Return the biases that a neighbour handed over, JSON of `BiasValue`."""
        with self._lock:
            return list(self._neighbours[region].biases)

    # ---------------------------------------------------------------- inside

    def _absorb(self, updates: TrackUpdates, ended: EndedTracks) -> NDArray[np.void]:
        marks = np.zeros(len(updates), MARK_DTYPE)
        reached_s = np.maximum.accumulate(np.r_[self._reached_s, updates.time_s])
        steps = np.floor(reached_s[1:] / STEP_S)
        # An end precedes later updates, as in the stream of events.
        leaving = np.searchsorted(reached_s[1:], np.sort(ended.time_s), side="left")
        gone = ended.track_id[np.argsort(ended.time_s, kind="stable")]
        left = 0
        for begin, end in self._pieces(updates, steps):
            until = int(np.searchsorted(leaving, begin, side="right"))
            left = self._remove(gone, left, until)
            self._reach(float(reached_s[begin + 1]))
            if steps[begin] > self._step:
                self._step = float(steps[begin])
                self._take_step()
            marks[begin:end] = self._update(updates, begin, end)
            self._reached_s = float(reached_s[end])
        self._remove(gone, left, len(gone))
        return marks

    def _reach(self, time_s: float) -> None:
        # The data time may have stood still for long: it does not show when a message was sent.
        for one in self._neighbours.values():
            one.heard_s = min(one.heard_s, time_s)
        self._reached_s = time_s

    def _remove(self, gone: NDArray[np.int64], left: int, until: int) -> int:
        if until > left:
            self._own = self._own[~np.isin(self._own["track_id"], gone[left:until])]
            for one in self._neighbours.values():
                one.rows["own_id"][np.isin(one.rows["own_id"], gone[left:until])] = 0
        return until

    # Rows between two decisions: a step of time or a new track begins a piece.
    def _pieces(
        self, updates: TrackUpdates, steps: NDArray[np.float64]
    ) -> Iterable[tuple[int, int]]:
        if not len(updates):
            return []
        begins = np.r_[True, np.diff(steps) > 0.0]
        first = np.unique(updates.track_id, return_index=True)[1]
        new = ~np.isin(updates.track_id[first], self._own["track_id"])
        begins[first[new]] = True
        # A track that is new has a piece of one row, so that it is decided first.
        begins[np.minimum(first[new] + 1, len(updates) - 1)] = True
        places = np.flatnonzero(begins).tolist()
        return zip(places, [*places[1:], len(updates)], strict=True)

    def _take_step(self) -> None:
        for one in self._neighbours.values():
            # After a pause of the own data, the last message may be an old one.
            sent_s = one.sent_s + self.rules.discard_after_s
            if self._reached_s - min(one.heard_s, sent_s) > self.rules.discard_after_s:
                one.rows = one.rows[:0]
        self._decide(np.arange(len(self._own)))

    def _update(self, updates: TrackUpdates, begin: int, end: int) -> NDArray[np.void]:
        tracks = updates.track_id[begin:end]
        # The last row of each track; `unique` returns the first of the reversed ones.
        ids, last = np.unique(tracks[::-1], return_index=True)
        rows = own_rows(updates, end - 1 - last)
        places, known = self._find(ids)
        for name in _DECIDED:
            rows[name][known] = self._own[name][places[known]]
        self._own[places[known]] = rows[known]
        if not known.all():
            self._own = np.insert(self._own, places[~known], rows[~known])
            self._decide_new(ids[~known])
        return marks_of(self._own[self._find(tracks)[0]])

    # Places of tracks by their numbers, and whether there is such a track.
    def _find(self, ids: NDArray[np.int64]) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        places = np.searchsorted(self._own["track_id"], ids)
        known = places < len(self._own)
        known[known] = self._own["track_id"][places[known]] == ids[known]
        return places, known

    def _decide_new(self, ids: NDArray[np.int64]) -> None:
        places, _ = self._find(ids)
        for one in self._neighbours.values():
            free = one.rows["own_id"] == 0
            rows = one.rows[free]
            match(self._own[places], rows)
            one.rows[free] = rows
        self._decide(places)

    # Names that tracks got before their address was known, and which are those of other aircraft.
    def _withdraw(self, others: NDArray[np.void]) -> None:
        own = self._own
        places = np.flatnonzero((own["aircraft"] != b"") & (own["mode_s_address"] >= 0))
        others = others[others["mode_s_address"] >= 0]
        others = others[np.isin(others["aircraft"], own["aircraft"][places])]
        addresses: dict[bytes, set[int]] = {}
        for row in others:
            addresses.setdefault(row["aircraft"], set()).add(int(row["mode_s_address"]))
        for place in places.tolist():
            known = addresses.get(own["aircraft"][place])
            if known and int(own["mode_s_address"][place]) not in known:
                own["aircraft"][place] = b""

    def _decide(self, places: NDArray[np.intp]) -> None:
        own, reached_s = self._own, self._reached_s
        now_s = self._aging_s(reached_s)
        claims = self._claims()
        claimed = np.isin(own["track_id"][places], list(claims))
        places = places[claimed | ~own["responsible"][places]]
        depth_m = self._depth_m(own[places])
        theirs = self._theirs(own[places])
        for place, depth, other in zip(places.tolist(), depth_m.tolist(), theirs, strict=True):
            row = own[place]
            fresh = now_s - float(row["time_s"]) <= self.rules.coast_after_s
            position = Position(
                self.name, bool(row["responsible"]), float(row["since_s"]),
                depth >= self.rules.hysteresis_m, fresh and not row["tentative"],
                other and reached_s - float(row["first_s"]) < self.rules.silence_s,
            )  # fmt: skip
            decided = decide(position, claims.get(int(row["track_id"]), ()), reached_s)
            follows = decided.follows
            row["responsible"], row["since_s"] = decided.responsible, decided.since_s
            row["duplicate_of"] = b"" if decided.responsible or follows is None else follows.track
            if follows is not None:
                own_name = reference(self.name, int(row["track_id"]))
                row["aircraft"] = b"" if follows.aircraft == own_name else follows.aircraft
                self.takeovers += decided.responsible

    # The data of a region may have ceased, and its data time with them: its tracks then age by the
    # latest time of all regions, less what regions may differ by (horizons, delays, and the time
    # from one update to the next). The messages are in the journal.
    def _aging_s(self, data_time_s: float) -> float:
        alive = (one.sent_s for one in self._neighbours.values() if self._is_alive(one))
        latest_s = max([self._reached_s, *alive])
        return max(data_time_s, latest_s - self.rules.coast_after_s)

    def _claims(self) -> dict[int, list[Claim]]:
        found: dict[int, list[Claim]] = {}
        for name, one in self._neighbours.items():
            if not self._is_alive(one):
                continue
            now_s = self._aging_s(one.sent_s)
            for row in one.rows[one.rows["responsible"] & (one.rows["own_id"] > 0)]:
                fresh = now_s - float(row["time_s"]) <= self.rules.coast_after_s
                fresh = fresh and not row["tentative"]
                track = reference(name, int(row["track_id"]))
                since_s, aircraft = float(row["since_s"]), bytes(row["aircraft"])
                claim = Claim(since_s, name, track, aircraft, fresh, one.hears)
                found.setdefault(int(row["own_id"]), []).append(claim)
        return found

    # Whether tracks are in the area of a neighbour that is alive.
    def _theirs(self, rows: NDArray[np.void]) -> list[bool]:
        alive = [self._is_alive(one) for one in self._neighbours.values()]
        home = self.areas.home(rows["latitude_rad"], rows["longitude_rad"])
        return [place >= 0 and alive[place] for place in home.tolist()]

    def _is_alive(self, one: Neighbour) -> bool:
        return self._reached_s - one.heard_s <= self.rules.silence_s

    def _is_silent(self, one: Neighbour) -> bool:
        # After a step back nothing is known of any, until there is an update.
        known = one.messages > 0 and bool(np.isfinite(self._reached_s))
        return known and not self._is_alive(one)

    def _depth_m(self, rows: NDArray[np.void]) -> NDArray[np.float64]:
        return self.areas.depth_m(rows["latitude_rad"], rows["longitude_rad"])

    def _figures(self, name: str, one: Neighbour) -> dict[str, Any]:
        age_s = self._reached_s - one.heard_s if one.heard_s < np.inf else 0.0
        state = "silent" if self._is_silent(one) else "alive"
        return {
            "name": name,
            "latitude_deg": self.areas.neighbours[name].latitude_deg,
            "longitude_deg": self.areas.neighbours[name].longitude_deg,
            "state": state if one.messages else "expected",
            "age_s": round(age_s, 2) if np.isfinite([self._reached_s, age_s]).all() else None,
            "tracks": len(one.rows),
            "matched": int(np.count_nonzero(one.rows["own_id"])),
            "messages": one.messages,
        }
