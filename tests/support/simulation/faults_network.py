"""Faults of networks and clients."""

import functools
import json
import random
from collections.abc import Callable
from dataclasses import replace

from support.simulation import traffic
from support.simulation.faults_data import window
from support.simulation.front import BODY_BYTES_MAX, KEYS, Exchange
from support.simulation.traffic import Message, Occurred
from support.simulation.world import World

_CLIENTS = ("alpha", "bravo", "charlie")
#: Readers that come back within 0.3 s, so that they are many.
READERS_AT_ONCE = 20


def _setting(
    name: str, low: float, high: float
) -> Callable[[World, random.Random, Occurred], None]:
    # A property of the network of one client in a window.
    def arm(world: World, drawn: random.Random, occurred: Occurred) -> None:
        sender = world.senders[drawn.choice(_CLIENTS)]
        value = drawn.uniform(low, high)
        begin_s, end_s = window(drawn)

        def on() -> None:
            setattr(sender, name, value)
            sender.effects[name] = occurred

        def off() -> None:
            setattr(sender, name, 0.0)
            sender.effects.pop(name, None)

        world.during(begin_s, end_s, on, off)

    return arm


def _partition(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """All clients lose the service, for some seconds or again and again."""
    for _ in range(drawn.randint(1, 3)):
        begin_s = drawn.uniform(2.0, 12.0)

        def cut(value: Callable[[Message], None] | None) -> None:
            for sender in world.senders.values():
                sender.cut = value

        world.during(
            begin_s, begin_s + drawn.uniform(0.3, 4.0), lambda: cut(lambda _: occurred()),
            lambda: cut(None),
        )  # fmt: skip


def _replay_of_keys(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """Messages are sent again with their old keys, and their keys with other content."""

    def again() -> None:
        # A message is compared by its accepted rows.
        old = [one for one in world.record.messages if one.receipts and one.receipts[0]["accepted"]]
        if not old:
            return
        earlier = drawn.choice(old)
        now_s = world.clock.elapsed_s
        if drawn.random() < 0.5:
            world.repeat(earlier, occurred)
        else:
            rows = [row | {"time_s": row["time_s"] + 0.25} for row in earlier.rows]
            body = traffic.body(earlier.media, rows)
            world.send(
                replace(
                    earlier, body=body, rows=rows, due_s=now_s, expected="error", receipts=[],
                    arrived=False, done=False, effects=[],
                ),
                occurred,
            )  # fmt: skip

    for _ in range(4):
        world.at(drawn.uniform(5.0, 15.0), again)


def _forged_source(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """A client sends plots of a sensor that is not its own, and squats keys of another."""
    for number in range(3):
        due_s = drawn.uniform(1.0, 14.0)
        row = {
            "time_s": traffic.START_S + due_s + 50.0, "sensor_id": "41-20", "kind": "radar",
            "range_m": 70_000.0, "azimuth_deg": 5.0, **traffic.identity(60),
        }  # fmt: skip
        body = traffic.body("application/json", [row])
        world.send(
            Message("rival", f"41-10/{number + 5}", "application/json", body, [row], due_s, "any"),
            occurred,
        )


def _datagrams(fault: Callable[[random.Random, bytes], list[bytes]]) -> Callable[..., None]:
    def arm(world: World, drawn: random.Random, occurred: Occurred) -> None:
        own = random.Random(drawn.random())
        begin_s, end_s = window(drawn)
        world.datagram_faults.append((begin_s, end_s, lambda octets: fault(own, octets), occurred))
        world.suspects.add(traffic.DATAGRAMS)

    return arm


def _flipped(drawn: random.Random, octets: bytes) -> list[bytes]:
    damaged = bytearray(octets)
    # Another fault may have cut all of it.
    for _ in range(drawn.randint(1, 4) if damaged else 0):
        damaged[drawn.randrange(len(damaged))] ^= 1 << drawn.randrange(8)
    return [bytes(damaged)]


def _forged_datagrams(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """Somebody floods the port with noise, more than the queue holds."""
    begin_s, _ = window(drawn)

    def flood() -> None:
        for _ in range(80):
            noise = drawn.randbytes(drawn.randint(1, 80))
            if world.throw(noise, "198.51.100.66", None) is False:
                occurred()

    for number in range(3):
        world.at(begin_s + number * 0.1, flood)


def _readers(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """A reader of the stream is slow, another leaves and comes back."""
    world.read_slowly(drawn.uniform(2.0, 6.0), occurred)
    world.read_slowly(drawn.uniform(0.5, 1.0), occurred)


def _reconnects(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """Many readers come at once, with old numbers."""
    begin_s, _ = window(drawn)
    served = 0

    def come() -> None:
        nonlocal served
        served += world.read_once(drawn.randrange(0, 400))
        if served == READERS_AT_ONCE:
            occurred()

    for number in range(30):
        world.at(begin_s + 0.01 * number, come)


def _oversized(world: World, drawn: random.Random, occurred: Occurred) -> None:
    for number in range(2):
        body = b"[" + b" " * (BODY_BYTES_MAX + drawn.randint(1, 100)) + b"]"
        due_s = drawn.uniform(1.0, 14.0)
        world.send(
            Message("any", f"large {number}", "application/json", body, [], due_s, "error"),
            occurred,
        )


def _slow_body(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """Bodies that come an octet at a time, and clients that leave in the middle."""
    headers = world.headers("any", "application/json")

    def begin() -> None:
        chunks = [(0.7, b" ") for _ in range(drawn.randint(3, 20))]
        exchange = Exchange("POST", "/v1/measurements", headers, chunks, whole=False)
        world.ask(exchange, lambda done: world.checked(done, 408, occurred))

    for _ in range(6):
        world.at(drawn.uniform(1.0, 11.0), begin)


def _set_clock(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """An operator sets the data clock back or forward."""
    world.all_suspect = True
    at_s, step_s = drawn.uniform(5.0, 11.0), drawn.choice((-600.0, -20.0, -3.0, 4.0))
    time_s = traffic.START_S + at_s + step_s
    path = f"/v1/clock?time_s={time_s:.1f}"
    headers = {"host": "simulated", "authorization": f"Bearer {KEYS['operator']}"}
    exchange = Exchange("POST", path, headers, [(0.0, b"")])
    world.at(at_s, lambda: world.ask(exchange, lambda done: world.checked(done, 200, occurred)))


def _change_sensors(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """An operator disables, enables, corrects, moves and adds radars."""
    headers = world.headers("operator", "application/json")
    described = {
        one.id: one.model_dump(mode="json", exclude_unset=True) for one in world.sensors.sensor
    }
    described["41-40"] = described["41-10"] | {"id": "41-40", "latitude_deg": 50.3}
    times_s = sorted(drawn.uniform(2.0, 15.0) for _ in range(drawn.randint(2, 5)))
    for at_s in times_s:
        name = drawn.choice(("41-10", "41-20", "41-30", "41-40"))
        one = described[name]
        kind = drawn.choice(("enabled", "range_sigma_m", "latitude_deg", ""))
        if kind == "enabled":
            one[kind] = not one.get(kind, True)
        elif kind == "range_sigma_m":
            one[kind] = drawn.choice((30.0, 50.0, 90.0))
        elif kind:
            one[kind] += drawn.choice((1e-6, 1e-3))
        reset = drawn.choice(("true", "false"))
        path = f"/v1/sensors/{name}?reset_biases={reset}"
        exchange = Exchange("PUT", path, headers, [(0.0, json.dumps(one).encode())])
        world.suspects.add(name)

        def ask(one: Exchange = exchange) -> None:
            world.ask(one, lambda done: world.checked(done, 200, occurred))

        world.at(at_s, ask)


def _asked(*asked: tuple[str, str, str, int]) -> Callable[[World, random.Random, Occurred], None]:
    # Requests by method, path and credentials, and the status that each must get.
    def arm(world: World, drawn: random.Random, occurred: Occurred) -> None:
        for method, path, bearer, status in asked:
            headers = {"host": "simulated", "authorization": f"Bearer {bearer}"}

            def ask(one: Exchange, status: int = status) -> None:
                world.ask(one, lambda done: world.checked(done, status, occurred))

            exchange = Exchange(method, path, headers, [(0.0, b"")])
            world.at(drawn.uniform(1.0, 14.0), functools.partial(ask, exchange))

    return arm


_FEED, _SCREEN = (f"mr_{name}-{'k' * 30}" for name in ("alpha", "screen"))
_GUESSES = _asked(
    *(("GET", "/v1/tracks", guess, 401) for guess in ("mr_guess", "a.b.c", "eyJhbGciOiJub25lIn0."))
)
_ROLES = _asked(
    ("GET", "/v1/tracks", _FEED, 403),
    ("POST", "/v1/flush", _FEED, 403),
    ("POST", "/v1/measurements", _SCREEN, 403),
)
_PATHS = _asked(
    ("GET", "/v1/tracks/..%2f..%2fetc", _SCREEN, 422),
    ("GET", "/v1/nothing", _SCREEN, 404),
)

FAULTS = (
    (20, "forged source of measurements", _forged_source),
    (20, "old keys again", _replay_of_keys),
    (8, "operator sets the data clock", _set_clock),
    (30, "operator changes sensors", _change_sensors),
    (31, "requests are lost", _setting("loss", 0.2, 0.9)),
    (31, "answers are lost", _setting("answer_loss", 0.2, 0.9)),
    (5, "requests arrive twice", _setting("copies", 0.5, 1.0)),
    (32, "partition", _partition),
    (32, "slow link", _setting("delay_s", 1.0, 5.0)),
    (1, "damaged datagrams", _datagrams(_flipped)),
    (2, "cut datagrams", _datagrams(lambda drawn, one: [one[: drawn.randrange(len(one))]])),
    (5, "datagrams twice", _datagrams(lambda drawn, one: [one, one])),
    (31, "datagrams are lost", _datagrams(lambda drawn, one: [one] * (drawn.random() < 0.5))),
    (17, "flood of datagrams", _forged_datagrams),
    (33, "slow readers", _readers),
    (34, "readers come back at once", _reconnects),
    (35, "body too large", _oversized),
    (36, "slow bodies", _slow_body),
    (38, "guessed credentials", _GUESSES),
    (39, "roles that do not suffice", _ROLES),
    (40, "paths that leave the root", _PATHS),
)
