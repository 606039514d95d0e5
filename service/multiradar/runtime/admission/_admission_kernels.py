"""Compiled admission of measurements by time; see `multiradar.runtime.admission.admission`.

Symbols: ``clock`` = state floats [data clock, floor, first and last time of a run, greatest time
accepted, time that the sensor farthest ahead has reached, time that others have reached]; ``run`` =
state integers [rows in the run, its first sensor, several sensors in it, first sensor ever
accepted, further sensors accepted (2: two or more), run within the forward jump, sensor farthest
ahead, second sensor accepted]; ``standing`` = [contradictions, rows in succession that were off the
data clock, samples heard] of each sensor; ``lead`` = by how much the last such row was ahead of the
data clock, s; ``heard`` = the last samples of each sensor, [time less time of reception, time of
reception], and behind them the greatest of the first ones; ``bounds`` = [reorder horizon,
tolerance, forward jump, rows that agree, time alone, time alone within the jump]; ``pace`` = [least
mean interval of the rows, time by which they may be ahead at it] of each sensor; ``tolerance`` =
lead over the others up to which the rows of each sensor advance the data clock, s; ``due`` = data
time at which the rows of each sensor so far would be due at that interval, s.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import kernel

ACCEPTED = 0
LATE = 1
FUTURE = 2
EXCESS = 3

CLOCK, FLOOR, RUN_FIRST, RUN_LAST, NEWEST, AHEAD, OTHERS = range(7)
RUN_COUNT, RUN_SENSOR, RUN_SEVERAL, SEEN_SENSOR, SEEN_FURTHER, RUN_NEAR, FIRST, SEEN_SECOND = range(
    8
)
CONTRADICTED, OFF, SAMPLES = range(3)
HORIZON, TOLERANCE, JUMP, AGREE, ALONE, ALONE_NEAR = range(6)
LEAD, RECEIVED = range(2)
INTERVAL, BURST = range(2)

#: After so many contradictions in succession, rows ahead of the data clock are rejected.
CONTRADICTED_MAX = 3
#: Samples of the reception kept for each sensor, the least number that counts, the time between
#: two of them and the time for which they count, s.
HEARD_MAX = 5
HEARD_MIN = 3
HEARD_STEP_S = 1.0
HEARD_FOR_S = 60.0

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@kernel
def admit(
    time_s: Floats,
    sensor: NDArray[np.int32],
    received_s: float,
    bounds: Floats,
    tolerance: Floats,
    pace: Floats,
    due: Floats,
    clock: Floats,
    run: Integers,
    standing: Integers,
    lead: Floats,
    heard: Floats,
    code: NDArray[np.int8],
    clock_s: Floats,
) -> None:
    """Classify row by row, in place; `clock_s` receives the data clock before each row.

    `received_s` is the time of reception of all rows, NaN where it is unknown.
    """
    for row in range(len(time_s)):
        time, s = time_s[row], sensor[row]
        before_s = clock[CLOCK]
        clock_s[row] = before_s
        if before_s == before_s and (time < before_s - bounds[HORIZON] or time < clock[FLOOR]):
            decided = LATE
            run[RUN_COUNT] = 0
        elif due[s] + pace[s, INTERVAL] > max(time, before_s) + pace[s, BURST]:
            # It advances nothing: the accepted rows alone give the same states.
            code[row] = EXCESS
            continue
        elif _has_drifted(time, s, received_s, bounds, tolerance, clock, run, standing, heard):
            decided = FUTURE
        elif time <= before_s or time <= _supported(s, clock, run) + tolerance[s]:
            decided = ACCEPTED
            _advance(time, s, tolerance, clock, run, standing, lead)
        else:
            decided = _ahead(
                time, s, received_s, bounds, tolerance, clock, run, standing, lead, heard
            )
        code[row] = decided
        if decided == ACCEPTED:
            clock[NEWEST] = max(clock[NEWEST], time)
            # While there is no data clock, nothing is counted.
            if clock[CLOCK] == clock[CLOCK]:
                reached_s = min(max(time, clock[CLOCK]), clock[CLOCK] + tolerance[s])
                due[s] = max(due[s], reached_s) + pace[s, INTERVAL]
        else:
            standing[s, OFF] += 1
            lead[s] = time - before_s
        if received_s == received_s:
            _hear(s, time - received_s, received_s, standing, heard)


@kernel
def _ahead(
    time: float,
    s: int,
    received_s: float,
    bounds: Floats,
    tolerance: Floats,
    clock: Floats,
    run: Integers,
    standing: Integers,
    lead: Floats,
    heard: Floats,
) -> int:
    """Decide on a row that is ahead of the data clock by more than the tolerance."""
    vote = 0
    if received_s == received_s:
        vote = _vote(time - received_s, received_s, bounds, standing, heard)
    if vote < 0:
        return FUTURE
    if vote == 0:
        only = run[SEEN_FURTHER] == 0 and run[SEEN_SENSOR] == s
        only = only or (run[SEEN_SENSOR] < 0 and len(standing) == 1)
        far = time > clock[CLOCK] + bounds[JUMP]
        far = far or standing[s, CONTRADICTED] >= CONTRADICTED_MAX
        if far:
            if not _agrees(time, s, bounds, clock, run):
                return FUTURE
            run[RUN_COUNT] = 0
        # Live, a sensor is heard for some time first, in which the others are as well, and vote.
        heard_enough = received_s != received_s or standing[s, SAMPLES] >= HEARD_MIN
        if not (far or only) and not _is_confirmed(time, s, heard_enough, bounds, clock, run):
            return ACCEPTED
    # A sensor that was alone remains so until a row of another.
    alone = run[RUN_COUNT] if vote == 0 and run[RUN_NEAR] == 1 and run[RUN_SENSOR] == s else 0
    _advance(time, s, tolerance, clock, run, standing, lead)
    run[RUN_COUNT] = alone
    return ACCEPTED


@kernel
def _agrees(time: float, s: int, bounds: Floats, clock: Floats, run: Integers) -> bool:
    """Continue the run of rows far ahead; return whether it moves the data clock."""
    # A run continues while each row is within the jump of the one before.
    fresh = run[RUN_COUNT] == 0 or run[RUN_NEAR] == 1
    if fresh or abs(time - clock[RUN_LAST]) > bounds[JUMP]:
        run[RUN_COUNT] = 0
        clock[RUN_FIRST] = time
        run[RUN_SENSOR] = s
        run[RUN_SEVERAL] = 0
        run[RUN_NEAR] = 0
    run[RUN_COUNT] += 1
    clock[RUN_LAST] = time
    if s != run[RUN_SENSOR]:
        run[RUN_SEVERAL] = 1
    plausible = (
        run[RUN_SEVERAL] == 1
        or (run[SEEN_FURTHER] == 0 and s == run[SEEN_SENSOR])
        or time - clock[RUN_FIRST] >= bounds[ALONE]
    )
    return bool(run[RUN_COUNT] >= bounds[AGREE] and plausible)


@kernel
def _is_confirmed(
    time: float, s: int, heard_enough: bool, bounds: Floats, clock: Floats, run: Integers
) -> bool:
    """Return whether the data clock follows a row within the jump; else the row waits."""
    fresh = run[RUN_COUNT] == 0 or run[RUN_NEAR] == 0
    if fresh or abs(time - clock[RUN_LAST]) > bounds[JUMP]:
        clock[RUN_FIRST] = time
        clock[RUN_LAST] = time
        run[RUN_COUNT] = 1
        run[RUN_SENSOR] = s
        run[RUN_NEAR] = 1
        return False
    if s == run[RUN_SENSOR]:
        run[RUN_COUNT] += 1
        clock[RUN_LAST] = max(clock[RUN_LAST], time)
        return bool(heard_enough and time - clock[RUN_FIRST] >= bounds[ALONE_NEAR])
    if time <= clock[RUN_LAST]:
        if clock[RUN_LAST] - time <= bounds[TOLERANCE]:
            _see(run[RUN_SENSOR], run)
        return True
    # Two sensors are ahead: the data clock follows the one that is less so.
    clock[CLOCK] = clock[RUN_LAST]
    _see(run[RUN_SENSOR], run)
    _reach(clock[RUN_LAST], run[RUN_SENSOR], clock, run)
    clock[RUN_FIRST] = time
    clock[RUN_LAST] = time
    run[RUN_COUNT] = 1
    run[RUN_SENSOR] = s
    return bool(time - clock[CLOCK] <= bounds[TOLERANCE])


@kernel
def _advance(
    time: float,
    s: int,
    tolerance: Floats,
    clock: Floats,
    run: Integers,
    standing: Integers,
    lead: Floats,
) -> None:
    """Accept a row, and advance the data clock to its time."""
    # A data clock that was never set is NaN, which no time is greater than.
    if not time <= clock[CLOCK]:
        clock[CLOCK] = time
    _see(s, run)
    _reach(time, s, clock, run)
    standing[s, CONTRADICTED] = 0
    standing[s, OFF] = 0
    if run[RUN_COUNT] > 0 and run[RUN_NEAR] == 1:
        other = run[RUN_SENSOR]
        if clock[RUN_LAST] <= _supported(other, clock, run) + tolerance[other]:
            clock[CLOCK] = max(clock[CLOCK], clock[RUN_LAST])
            _reach(clock[RUN_LAST], other, clock, run)
        elif other != s:
            standing[other, CONTRADICTED] += 1
            standing[other, OFF] += 1
            lead[other] = clock[RUN_LAST] - clock[CLOCK]
    run[RUN_COUNT] = 0


@kernel
def _supported(s: int, clock: Floats, run: Integers) -> float:
    """Return the time that other sensors have reached; of two, none is more right: the clock."""
    if run[SEEN_FURTHER] < 2:
        return float(clock[CLOCK])
    return _others_reached(s, clock, run)


@kernel
def _others_reached(s: int, clock: Floats, run: Integers) -> float:
    """Return the time that the sensor farthest ahead among the others has reached."""
    return float(clock[OTHERS] if s == run[FIRST] else clock[AHEAD])


@kernel
def _has_drifted(
    time: float,
    s: int,
    received_s: float,
    bounds: Floats,
    tolerance: Floats,
    clock: Floats,
    run: Integers,
    standing: Integers,
    heard: Floats,
) -> bool:
    """Return whether one of two sensors has drifted ahead of the other and of the machine.

    The lead over the time of reception has then grown since the sensor was first heard, and by more
    than that of the other: the clock of the machine may drift, too.
    """
    if not (time > clock[CLOCK] and received_s == received_s and run[SEEN_FURTHER] == 1):
        return False
    other = run[SEEN_SECOND] if s == run[SEEN_SENSOR] else run[SEEN_SENSOR]
    lead_s = time - received_s
    if time <= _others_reached(s, clock, run) + tolerance[s] or standing[s, SAMPLES] < HEARD_MIN:
        return False
    other_grown_s = 0.0
    for k in range(min(standing[other, SAMPLES], HEARD_MAX)):
        grown_s = heard[other, k, LEAD] - heard[other, HEARD_MAX, LEAD]
        other_grown_s = max(other_grown_s, grown_s)
    if lead_s - heard[s, HEARD_MAX, LEAD] <= other_grown_s + bounds[TOLERANCE]:
        return False
    return _vote(lead_s, received_s, bounds, standing, heard) < 0


@kernel
def _reach(time: float, s: int, clock: Floats, run: Integers) -> None:
    """Note the time that a sensor has reached."""
    if s == run[FIRST] or run[FIRST] < 0:
        run[FIRST] = s
        clock[AHEAD] = max(clock[AHEAD], time)
    elif time > clock[AHEAD]:
        clock[OTHERS] = clock[AHEAD]
        clock[AHEAD] = time
        run[FIRST] = s
    else:
        clock[OTHERS] = max(clock[OTHERS], time)


@kernel
def _see(s: int, run: Integers) -> None:
    if run[SEEN_SENSOR] < 0:
        run[SEEN_SENSOR] = s
    elif s != run[SEEN_SENSOR] and run[SEEN_SECOND] < 0:
        run[SEEN_SECOND] = s
        run[SEEN_FURTHER] = 1
    elif s != run[SEEN_SENSOR] and s != run[SEEN_SECOND]:
        run[SEEN_FURTHER] = 2


@kernel
def _vote(
    lead_s: float, received_s: float, bounds: Floats, standing: Integers, heard: Floats
) -> int:
    """Return 1 if most clocks support a row, -1 if at least two and most contradict it, else 0.

    Those who vote are the clock of the machine and all sensors that were heard in real time; a
    clock contradicts a time that it has not reached.
    """
    tolerance_s = bounds[TOLERANCE]
    support, contradict = 0, 0
    if lead_s > tolerance_s:
        contradict += 1
    elif lead_s >= -bounds[HORIZON]:
        support += 1
    for s in range(len(standing)):
        count = min(standing[s, SAMPLES], HEARD_MAX)
        if count < HEARD_MIN:
            continue
        least, most, latest_s = np.inf, -np.inf, -np.inf
        for k in range(count):
            least = min(least, heard[s, k, LEAD])
            most = max(most, heard[s, k, LEAD])
            latest_s = max(latest_s, heard[s, k, RECEIVED])
        # In real time the lead stays the same; in a replay at another speed it does not.
        if most - least > tolerance_s or received_s - latest_s > HEARD_FOR_S:
            continue
        if lead_s > 0.5 * (least + most) + tolerance_s:
            contradict += 1
        else:
            support += 1
    if contradict >= 2 and contradict > support:
        return -1
    return 1 if support > contradict else 0


@kernel
def hear(
    time_s: Floats,
    sensor: NDArray[np.int32],
    received_s: float,
    tolerance: Floats,
    clock: Floats,
    standing: Integers,
    lead: Floats,
    heard: Floats,
) -> None:
    """Count rows that are not admitted, and keep samples of their reception, in place.

    A row ahead of the data clock, too, is off: its sensor is wrong, not the clock of the machine.
    """
    for row in range(len(time_s)):
        s = sensor[row]
        _hear(s, time_s[row] - received_s, received_s, standing, heard)
        if time_s[row] > clock[CLOCK] + tolerance[s]:
            standing[s, OFF] += 1
            lead[s] = time_s[row] - clock[CLOCK]


@kernel
def _hear(s: int, lead_s: float, received_s: float, standing: Integers, heard: Floats) -> None:
    """Keep a sample of the reception, at most one in each step."""
    count = standing[s, SAMPLES]
    if count > 0 and received_s - heard[s, (count - 1) % HEARD_MAX, RECEIVED] < HEARD_STEP_S:
        return
    if count == 0 or (count < HEARD_MAX and lead_s > heard[s, HEARD_MAX, LEAD]):
        heard[s, HEARD_MAX, LEAD] = lead_s
    heard[s, count % HEARD_MAX, LEAD] = lead_s
    heard[s, count % HEARD_MAX, RECEIVED] = received_s
    standing[s, SAMPLES] += 1
