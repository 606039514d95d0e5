"""Aircraft drawn at random from the seed of a scenario."""

from dataclasses import replace

import numpy as np

from multiradar.simulation.scenario.model import Aircraft, Leg, Scenario, Span, Traffic

# Independent random streams of a seed.
_TRAFFIC_STREAM = 0
_RUN_STREAM = 1

# Limits of the speed as fractions of the initial speed.
_SPEED_LEAST, _SPEED_MOST = 0.6, 1.5

_MODE_S_FIRST = 0x400000
# 0000, 7500, 7600 and 7700 are reserved; these are not.
_MODE_3A_FIRST, _MODE_3A_COUNT = 0o1000, 0o5000


def run_generator(seed: int) -> np.random.Generator:
    """Return the generator of noise, detections, drift and manoeuvres for a seed."""
    return _stream(seed, _RUN_STREAM)


def all_aircraft(scenario: Scenario) -> tuple[Aircraft, ...]:
    """Return the aircraft of a scenario, including its drawn traffic.

    Parameters
    ----------
    scenario : Scenario
        The same scenario with the same seed gives the same aircraft.

    Returns
    -------
    tuple of Aircraft
        The aircraft of the scenario, then its traffic; each with its own track number, Mode S
        address and Mode 3/A code.
    """
    rng = _stream(scenario.seed, _TRAFFIC_STREAM)
    number = max((one.track_number for one in scenario.aircraft), default=0)
    found = list(scenario.aircraft)
    for traffic in scenario.traffic:
        for _ in range(traffic.count):
            number += 1
            found.append(_draw(traffic, number, scenario.duration_s, rng))
    return tuple(_with_identity(one) for one in found)


def _draw(traffic: Traffic, number: int, duration_s: float, rng: np.random.Generator) -> Aircraft:
    # All numbers are drawn, needed or not: properties of one aircraft do not affect the next.
    east, north = _within(traffic.east_m, rng), _within(traffic.north_m, rng)
    height, speed = _within(traffic.height_m, rng), _within(traffic.speed_mps, rng)
    heading, start = _within(traffic.heading_rad, rng), _within(traffic.start_s, rng)
    life = _within(traffic.life_s, rng)
    received, equipped = rng.uniform(size=2)
    own, delay_rng = rng.spawn(2)
    end = min(start + life, duration_s)
    return Aircraft(
        track_number=number,
        east_m=east,
        north_m=north,
        height_m=height,
        speed_mps=speed,
        heading_rad=heading,
        start_s=start,
        end_s=start + life,
        legs=_legs(traffic, traffic.leg_s, (speed, height), end - start, own)
        if traffic.leg_s
        else (),
        coupled=traffic.coupled,
        acceleration_density=traffic.acceleration_density,
        height_step_m=traffic.height_step_m,
        reports_height=bool(received < traffic.heard_height_share),
        reports_position=bool(equipped < traffic.equipped_share),
        transponder_delay_m=traffic.transponder_delay_sigma_m * float(delay_rng.normal()),
    )


def _legs(
    traffic: Traffic, leg_s: Span, start: Span, length_s: float, rng: np.random.Generator
) -> tuple[Leg, ...]:
    legs: list[Leg] = []
    (start_mps, height), flown = start, 0.0
    speed = start_mps
    while flown < length_s:
        duration, turn = _within(leg_s, rng), _within(traffic.turn_rate_rad_per_s, rng)
        turn *= float(rng.choice([-1.0, 1.0]))
        acceleration = _within(traffic.acceleration_mps2, rng)
        if not _SPEED_LEAST < (speed + acceleration * duration) / start_mps < _SPEED_MOST:
            acceleration = -acceleration
        straight = len(legs) % 2 == 0
        climb = _climb(traffic, height, duration, rng) if straight else 0.0
        legs.append(
            Leg(duration, climb_mps=climb) if straight else Leg(duration, turn, acceleration)
        )
        height += climb * duration
        flown, speed = flown + duration, speed + legs[-1].acceleration_mps2 * duration
    return tuple(legs)


def _climb(traffic: Traffic, height: float, duration_s: float, rng: np.random.Generator) -> float:
    if traffic.climb_mps == (0.0, 0.0):
        return 0.0
    climb = _within(traffic.climb_mps, rng)
    least, most = traffic.height_m
    for rate in (climb, -climb):
        if least <= height + rate * duration_s <= most:
            return rate
    return 0.0


def _with_identity(aircraft: Aircraft) -> Aircraft:
    number = aircraft.track_number
    address, code = aircraft.mode_s_address, aircraft.mode_3a
    return replace(
        aircraft,
        mode_s_address=_MODE_S_FIRST + number if address is None else address,
        mode_3a=_MODE_3A_FIRST + number % _MODE_3A_COUNT if code is None else code,
    )


def _within(span: Span, rng: np.random.Generator) -> float:
    least, most = span
    drawn = rng.uniform()
    return least if least == most else least + (most - least) * float(drawn)


def _stream(seed: int, stream: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, stream])))
