"""Answers to queries: tracks, biases, sensors, status, and those of the registry."""

import json
import math
from collections.abc import Callable, Mapping
from functools import partial
from math import inf
from typing import Any

from multiradar.access.parameters import number
from multiradar.clock import SystemClock
from multiradar.errors import DeadlineError, ForecastError, RequestError
from multiradar.ingest.zenoh.bus import Request, wrong_parameters
from multiradar.ingest.zenoh.catch_up import CatchUp
from multiradar.ingest.zenoh.counts import ZenohCounts
from multiradar.ingest.zenoh.keys import (
    BIASES,
    SENSORS,
    STATUS,
    TRACKS,
    is_sensor_id,
    last_part,
    query_key,
    sensor_key,
    track_id,
)
from multiradar.runtime.ports import View
from multiradar.runtime.queries.deadline import check_deadline, deadline
from multiradar.runtime.queries.parameters import Parameter
from multiradar.runtime.queries.registry import NO_ANSWER, QUERIES, Query

#: Runs a function in another thread; False when its queue is full.
Later = Callable[[Callable[[], None]], bool]
_CLOCK = SystemClock()
#: Updates in one answer to a query with `after`, unless it asks for fewer.
CATCH_UP_LIMIT = 10_000
_WILD = frozenset({"*", "**"})
_NO_PARAMETERS: frozenset[str] = frozenset()
_BAD_REQUEST = 400
_NOT_FOUND = 404
_CONFLICT = 409


class Answers:
    """Handlers of the queryable keys.

    Parameters
    ----------
    view : View
        The read interface of the service.
    status : callable
        Returns the status document.
    catch_up : CatchUp
        The last track updates.
    counts : ZenohCounts
        Counts queries.
    later, later_expensive : callable
        Run a function in another thread, the second one those of the registry; False when the
        queue is full.
    deadline_s : float
        Maximum time from a query of the registry to its answer.
    """

    def __init__(
        self,
        view: View,
        status: Callable[[], bytes],
        catch_up: CatchUp,
        counts: ZenohCounts,
        later: Later,
        *,
        later_expensive: Later,
        deadline_s: float,
    ) -> None:
        self._view = view
        self._status = status
        self._catch_up = catch_up
        self._counts = counts
        self._later = later
        self._later_expensive = later_expensive
        self._deadline_s = deadline_s

    def handlers(self) -> dict[str, Callable[[Request], None]]:
        """Return the handler of each key expression."""
        return {
            f"{TRACKS}/*": self._guarded(self._tracks, frozenset({"after", "limit"})),
            f"{BIASES}/*": self._guarded(self._biases, _NO_PARAMETERS),
            f"{SENSORS}/*": self._guarded(self._sensors, _NO_PARAMETERS),
            STATUS: self._guarded(self._answer_status, _NO_PARAMETERS),
            **{
                query_key(query, "*"): self._guarded(
                    partial(self._ask, query),
                    frozenset(one.name for one in query.parameters),
                    self._later_expensive,
                )
                for query in QUERIES
            },
        }

    # ---------------------------------------------------------------- inside

    def _guarded(
        self,
        answer: Callable[[Request], None],
        parameters: frozenset[str],
        later: Later | None = None,
    ) -> Callable[[Request], None]:
        run = later or self._later

        def answered(request: Request, until_s: float) -> None:
            try:
                _require_known(request, parameters)
                with deadline(until_s - _CLOCK.monotonic_s()):
                    check_deadline()
                    answer(request)
            except DeadlineError:
                self._reject(request, "QUERY_TIMEOUT", self._late)
            except RequestError as error:
                self._reject(request, error.code, str(error))
            except Exception as error:  # Every query is answered.
                self._reject(request, "INTERNAL", f"the query failed: {type(error).__name__}")
            finally:
                request.finish()

        def handle(request: Request) -> None:
            self._counts.add(queries=1)
            until_s = inf if later is None else _CLOCK.monotonic_s() + self._deadline_s
            if not run(lambda: answered(request, until_s)):
                self._reject(request, "BUSY", "too many queries are queued; try again later")
                request.finish()

        return handle

    @property
    def _late(self) -> str:
        return (
            f"the query did not finish within {self._deadline_s:g} s (http.query_deadline_s); "
            "use a shorter horizon or window, or try again later"
        )

    def _reject(self, request: Request, code: str, reason: str) -> None:
        self._counts.add(queries_refused=1)
        request.reply_error(json.dumps({"code": code, "reason": reason}).encode())

    def _tracks(self, request: Request) -> None:
        name = last_part(request.key)
        if "after" in request.parameters:
            self._updates_after(request, None if name in _WILD else name)
        elif name in _WILD:
            for row in self._view.tracks().iter_rows(named=True):
                _reply(request, f"{TRACKS}/{row['track_id']}", row, row.get("sequence"))
        else:
            track = self._view.track(_known_track(name))
            if track is None:
                raise _no_track(name)
            _reply(request, f"{TRACKS}/{track['track_id']}", track, track.get("sequence"))

    def _updates_after(self, request: Request, name: str | None) -> None:
        after = _whole(request.parameters, "after", 0)
        limit = min(_whole(request.parameters, "limit", CATCH_UP_LIMIT), CATCH_UP_LIMIT)
        wanted = None if name is None else f"{TRACKS}/{_known_track(name)}"
        updates, lost = self._catch_up.after(after, limit, wanted)
        if lost:
            reason = (
                f"the {lost} updates after {after} are no longer available; later updates follow"
            )
            self._reject(request, "GAP", reason)
        for update in updates:
            request.reply(update.key, update.payload, b"%d" % update.sequence)

    def _biases(self, request: Request) -> None:
        for sensor in self._asked_for(request):
            name = sensor["id"]
            _reply(request, sensor_key(BIASES, name), sensor["biases"], None)

    def _sensors(self, request: Request) -> None:
        for sensor in self._asked_for(request):
            _reply(request, sensor_key(SENSORS, sensor["id"]), sensor, None)

    def _asked_for(self, request: Request) -> list[dict[str, Any]]:
        name = last_part(request.key)
        known = {sensor["id"]: sensor for sensor in self._view.sensors()}
        if name in _WILD:
            return list(known.values())
        if not is_sensor_id(name) or name not in known:
            raise RequestError(_NOT_FOUND, "NOT_FOUND", f"no sensor {ascii(name)[:80]}")
        return [known[name]]

    def _ask(self, query: Query, request: Request) -> None:
        track = _known_track(last_part(request.key)) if query.of_track else None
        given = {one.name: _value(one, request.parameters) for one in query.parameters}
        try:
            document = self._view.ask(query, track, **given)
        except ForecastError as error:
            raise RequestError(_BAD_REQUEST, "OUT_OF_RANGE", str(error)) from error
        except NO_ANSWER as error:
            raise RequestError(_CONFLICT, error.code, str(error)) from error
        if document is None:
            raise _no_track(str(track))
        _reply(request, query_key(query, "" if track is None else str(track)), document, None)

    def _answer_status(self, request: Request) -> None:
        request.reply(STATUS, self._status(), b"")


def _reply(request: Request, key: str, document: object, number: object) -> None:
    content = json.dumps(_finite(document), allow_nan=False, default=str).encode()
    request.reply(key, content, b"" if number is None else str(number).encode())


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {name: _finite(part) for name, part in value.items()}
    if isinstance(value, list):
        return [_finite(part) for part in value]
    return value


def _known_track(name: str) -> int:
    track = track_id(name)
    if track is None:
        reason = f"expected a key ending in a track number, was {ascii(name)[:80]}"
        raise RequestError(_BAD_REQUEST, "OUT_OF_RANGE", reason)
    return track


def _no_track(name: str) -> RequestError:
    return RequestError(_NOT_FOUND, "NOT_FOUND", f"no live track {name}")


def _whole(parameters: Mapping[str, str], name: str, absent: int) -> int:
    text = parameters.get(name, "")
    if not text:
        return absent
    if not (text.isascii() and text.isdigit() and len(text) < 19):
        raise _bad(name, "a whole number", text)
    return int(text)


def _value(parameter: Parameter, given: Mapping[str, str]) -> float | str | None:
    text = given.get(parameter.name, "")
    if not text:
        return parameter.default
    if parameter.kind is str:
        return text
    if parameter.kind is int:
        return _whole(given, parameter.name, 0)
    try:
        value = number(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise _bad(parameter.name, "a finite number", text)
    return value


def _require_known(request: Request, known: frozenset[str]) -> None:
    wrong = wrong_parameters(request, known)
    if wrong is not None:
        raise RequestError(_BAD_REQUEST, *wrong)


def _bad(name: str, expected: str, text: str) -> RequestError:
    return RequestError(
        _BAD_REQUEST, "NOT_A_NUMBER", f"{name}: expected {expected}, was {ascii(text)[:80]}"
    )
