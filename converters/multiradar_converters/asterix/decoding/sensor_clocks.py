"""Clock offset and latency of sensors: times of messages beside those of their reception.

A message is received after its time of day by the offset of the clocks and its latency: processing,
waiting for the end of a sector, transport. The smallest difference is that of the fastest message,
mostly a north mark: almost the offset alone. Medians are those of reports.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.decoding import clocks
from multiradar_converters.asterix.decoding.bounds import DAY_S
from multiradar_converters.asterix.decoding.services import Services
from multiradar_converters.asterix.decoding.timing import Timed
from multiradar_converters.asterix.layout.columns import Integers, Numbers
from multiradar_converters.distinct import distinct

#: Codes of alarms: even the fastest messages are received too early or too late; or only even the
#: fastest reports too late.
CLOCK_ALARM, LATENCY_ALARM = "clock", "latency"
TIME_ALARMS = (CLOCK_ALARM, LATENCY_ALARM)
#: Bounds of both, s before and after the time of a message: clocks are synchronised to some 10 ms,
#: and the processing of a radar takes less than a second.
AHEAD_MAX_S, LATE_MAX_S = 0.1, 1.0
#: Messages for an alarm.
MESSAGES_MIN = 10
#: Quantile of the differences that stands for the smallest: single wrong times do not count.
_FASTEST = 0.01
_ZONE_S = 1800.0
# An offset so close to whole half hours is that of a time zone, s.
_ZONE_MAX_S = 30.0
#: Scales of time ahead of UTC, s, since 2017, and how close to them an offset is theirs.
_SCALES = {"GPS": 18.0, "TAI": 37.0}
_SCALE_MAX_S = 1.0


@dataclass(frozen=True)
class Differences:
    """Times of reception minus times of messages.

    Attributes
    ----------
    source : int64[n]
        Source of each message.
    delay_s : float64[n]
        Reception minus time, between −12 and 12 h.
    report : bool[n]
        Whether it is a report of a target; else a service message.
    """

    source: Integers
    delay_s: Numbers
    report: NDArray[np.bool_]


@dataclass(frozen=True)
class SensorClock:
    """Clock and latency of a sensor.

    Attributes
    ----------
    messages : int
        Messages with a time, and a time of reception.
    offset_s : float
        Times of the fastest messages minus their times of reception, s: positive where its clock is
        ahead, negative where it is behind or all messages are late.
    latency_min_s, latency_median_s, latency_p99_s : float
        First percentile, median and 99th percentile of reception minus time of target reports, s;
        NaN without any.
    """

    messages: int
    offset_s: float
    latency_min_s: float
    latency_median_s: float
    latency_p99_s: float

    def document(self) -> dict[str, object]:
        """Return the figures for JSON, to the millisecond; None for unknown ones."""
        figures = {
            "clock_offset_s": self.offset_s,
            "latency_min_s": self.latency_min_s,
            "latency_median_s": self.latency_median_s,
            "latency_p99_s": self.latency_p99_s,
        }
        return {"messages": self.messages} | {
            name: round(value, 3) + 0.0 if np.isfinite(value) else None
            for name, value in figures.items()
        }


def differences(
    source: Integers, time_s: Numbers, received_s: Numbers, *, reports: bool
) -> Differences:
    """Return how much later messages were received than their times.

    Parameters
    ----------
    source : int64[n]
        Source of each message.
    time_s, received_s : float64[n]
        Time of day, and time of reception (of day or Unix time), s; NaN for none.
    reports : bool
        Whether they are reports of targets.

    Returns
    -------
    Differences
        Of the messages with both times.
    """
    delay_s = (received_s - time_s + DAY_S / 2.0) % DAY_S - DAY_S / 2.0
    known = ~np.isnan(delay_s)
    return Differences(source[known], delay_s[known], np.full(int(known.sum()), reports))


def of_reports(reports: Timed) -> Differences:
    """Return the differences of target reports whose times are those of their sensors."""
    own = np.isin(reports.origin, (clocks.RECORD, clocks.TRUNCATED, clocks.ANTENNA))
    time_s = np.where(own, reports.targets.time_s, np.nan)
    return differences(reports.rows.source, time_s, reports.rows.received_s, reports=True)


def of_services(source: Integers, services: Services, received_s: Numbers) -> Differences:
    """Return the differences of service messages."""
    return differences(source, services.time_s, received_s, reports=False)


def joined(parts: list[Differences]) -> Differences:
    """Return all differences of several lists."""
    if not parts:
        return Differences(np.empty(0, np.int64), np.empty(0), np.empty(0, np.bool_))
    return Differences(
        np.concatenate([one.source for one in parts]),
        np.concatenate([one.delay_s for one in parts]),
        np.concatenate([one.report for one in parts]),
    )


def sensor_clocks(found: Differences) -> dict[int, SensorClock]:
    """Return the clock of each source.

    Parameters
    ----------
    found : Differences
        Its messages.

    Returns
    -------
    dict of SensorClock
        By source; empty without times of reception.
    """
    return {
        source: sensor_clock(found.delay_s[own & found.report], found.delay_s[own & ~found.report])
        for source in distinct(found.source).tolist()
        if (own := found.source == source).any()
    }


def sensor_clock(reports_s: Numbers, services_s: Numbers) -> SensorClock:
    """Return the clock of a sensor from the differences of its reports and service messages."""
    fastest = [float(np.quantile(one, _FASTEST)) for one in (reports_s, services_s) if len(one)]
    quantiles = (_FASTEST, 0.5, 0.99)
    least, median, late = (
        np.quantile(reports_s, quantiles).tolist() if len(reports_s) else [np.nan] * 3
    )
    return SensorClock(
        messages=len(reports_s) + len(services_s),
        offset_s=-min(fastest),
        latency_min_s=least,
        latency_median_s=median,
        latency_p99_s=late,
    )


def receiver_zone_s(found: Mapping[int, SensorClock]) -> float:
    """Return the time zone of the times of reception, s east of UTC; 0 if they are in UTC.

    It is that of most sensors, if their offset is one of whole half hours.
    """
    offsets = [one.offset_s for one in found.values() if one.messages >= MESSAGES_MIN]
    return _zone(-float(np.median(offsets))) if offsets else 0.0


def clock_alarm(one: SensorClock, zone_s: float = 0.0) -> tuple[str, str] | None:
    """Return the alarm of a sensor about its times, None if there is none.

    Parameters
    ----------
    one : SensorClock
        The sensor.
    zone_s : float
        Time zone of the times of reception, as from `receiver_zone_s`.

    Returns
    -------
    (str, str) or None
        Its code, and in words what is the case and what to do.
    """
    offset_s, least_s = one.offset_s + zone_s, one.latency_min_s - zone_s
    if one.messages < MESSAGES_MIN:
        return None
    if -LATE_MAX_S <= offset_s <= AHEAD_MAX_S:
        if not least_s > LATE_MAX_S:
            return None
        return LATENCY_ALARM, (
            f"even the fastest reports arrive {_duration(least_s)} after their time stamps, "
            f"but service messages after {_duration(abs(offset_s))}: check the processing and "
            "network of the sensor"
        )
    way = "ahead of" if offset_s > 0.0 else "behind"
    said = f"time stamps are at least {_duration(abs(offset_s))} {way} reception"
    if zone := _zone(offset_s):
        why = f"probably local time, {zone / 3600.0:+g} h from UTC; set the sensor clock to UTC"
    elif scale := _scale(offset_s):
        ahead = f"{_SCALES[scale]:.0f} s ahead of UTC"
        why = f"probably {scale} time, {ahead}; set the sensor clock to UTC"
    elif offset_s > 0.0:
        why = "the sensor clock is fast or the receiver clock is slow; synchronise both clocks"
    else:
        why = (
            "the sensor clock is slow, the receiver clock is fast, or the data are delayed; "
            "synchronise both clocks"
        )
    return CLOCK_ALARM, f"{said}: {why}"


def _zone(offset_s: float) -> float:
    zone = round(offset_s / _ZONE_S) * _ZONE_S
    return zone if abs(offset_s - zone) <= _ZONE_MAX_S else 0.0


def _scale(offset_s: float) -> str | None:
    near = (name for name, ahead in _SCALES.items() if abs(offset_s - ahead) <= _SCALE_MAX_S)
    return next(near, None)


def _duration(seconds: float) -> str:
    return f"{seconds:.2f} s" if seconds < 120.0 else f"{seconds / 60.0:.1f} min"
