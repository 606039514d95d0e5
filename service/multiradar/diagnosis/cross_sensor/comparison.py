"""The plots of each sensor against the plots of all others."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import (
    NO_AGREEMENT,
    Agreement,
    polar_agreement,
    position_agreement,
)
from multiradar.diagnosis.cross_sensor.hypotheses import Polar, as_given
from multiradar.diagnosis.cross_sensor.references import (
    RECORDING,
    Pairs,
    Paths,
    candidate_pairs,
    joined,
    keys_by_sensor,
    named_pairs,
    named_paths,
    recorded_pairs,
    tracked_paths,
)
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.plots import (
    Booleans,
    Floats,
    Plots,
    Site,
    located,
    plots_of,
    positions,
    reported,
)
from multiradar.estimation.measurement.kinds import KIND_POSITION, KIND_RADAR
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
    SensorTable,
)
from multiradar.geodesy.wgs84 import geodetic_to_ecef

#: Maximum and minimum number of compared plots of a sensor.
TESTED_MAX = 400
TESTED_MIN = 20
#: A sensor agrees with others when this fraction of its plots matches their positions.
AGREES_MIN = 0.5
#: Estimated offsets are those of the radar up to so many of their prior standard deviations.
_PRIOR_SIGMAS = 2.0

Reading = Callable[[Floats, Floats], Polar]


def configured_bias(sensors: SensorTable, number: int, kind: int) -> tuple[float, float]:
    """Return a bias as configured and its prior standard deviation, 0 where it is fixed."""
    columns = np.flatnonzero(
        (sensors.parameter_sensor == number) & (sensors.parameter_kind == kind)
    )
    if len(columns) == 0:
        return float(sensors.known_bias[number, kind]), 0.0
    return float(sensors.prior_mean[columns[0]]), float(sensors.prior_sigma[columns[0]])


# Plots without the offsets that the run estimated, within twice the prior standard deviation.
def _corrected(plots: Plots, evidence: Evidence, number: int) -> Plots:
    offsets = []
    for kind in (PARAMETER_RANGE_OFFSET, PARAMETER_AZIMUTH_OFFSET):
        configured, sigma = configured_bias(evidence.sensors, number, kind)
        estimate, _ = evidence.biases.get((number, kind), (configured, 0.0))
        offsets.append(
            estimate if abs(estimate - configured) <= _PRIOR_SIGMAS * sigma else configured
        )
    return replace(
        plots,
        range_m=plots.range_m - offsets[0],
        azimuth_deg=plots.azimuth_deg - np.degrees(offsets[1]),
    )


class Comparison:
    """The retained plots of each sensor, and the positions of their aircraft by others.

    Configured time offsets are subtracted, and those of positions that the run estimated; range and
    azimuth biases are not.

    Parameters
    ----------
    evidence : Evidence
        Counts and plots of the run.
    corrected : bool
        Whether to subtract the estimated offsets of radars, too, where they are not too large.
    """

    def __init__(self, evidence: Evidence, *, corrected: bool = False) -> None:
        self._sensors = evidence.sensors
        #: As in the evidence.
        self.proceed = evidence.proceed
        self._tracked = evidence.tracked()
        self._plots: dict[int, Plots] = {}
        self._paths_as_given: dict[tuple[int, int], Paths] = {}
        for name, source in evidence.sources.items():
            self.proceed()
            number = evidence.number(name)
            if number < 0 or self._sensors.moving[number]:
                continue
            plots = plots_of(source.plots())
            polar = plots.range_m + plots.azimuth_deg
            column = polar if self.is_radar(number) else plots.latitude_deg
            wanted = self._sensors.kinds[number] in (KIND_RADAR, KIND_POSITION)
            plots = plots.select(np.isfinite(column) & wanted)
            late_s, _ = configured_bias(self._sensors, number, PARAMETER_TIME_OFFSET)
            if self._sensors.kinds[number] == KIND_POSITION:
                late_s, _ = evidence.biases.get((number, PARAMETER_TIME_OFFSET), (late_s, 0.0))
            plots = replace(plots, time_s=plots.time_s - late_s)
            if corrected and self.is_radar(number):
                plots = _corrected(plots, evidence, number)
            if plots.size:
                self._plots[number] = plots

    @property
    def numbers(self) -> tuple[int, ...]:
        """The sensors with plots that can be compared, as rows of the table."""
        return tuple(sorted(self._plots))

    def is_radar(self, number: int) -> bool:
        """Return whether a sensor measures range and azimuth."""
        return bool(self._sensors.kinds[number] == KIND_RADAR)

    def site(self, number: int) -> Site:
        """Return the site of a sensor as configured, rad and m."""
        sensors = self._sensors
        return (
            float(sensors.latitude_rad[number]),
            float(sensors.longitude_rad[number]),
            float(sensors.height_m[number]),
        )

    def site_of_radar(self, number: int) -> Site | None:
        """Return the site of a radar; None for a sensor that reports positions."""
        return self.site(number) if self.is_radar(number) else None

    def have_heights(self, number: int, pairs: Pairs) -> Booleans:
        """Return which pairs compare positions by heights that were reported, (k,) bool.

        A height that is assumed displaces a plot, as ranges that are a fraction too long do.
        Reported positions need none.

        Parameters
        ----------
        number : int
            The sensor.
        pairs : Pairs
            Positions by others of the aircraft of its tested plots.
        """
        own = np.isfinite(self.tested(number).height_m)[pairs.plot]
        others, at = np.unique(pairs.source, return_inverse=True)
        known, polar = np.ones((2, len(others)), np.bool_)
        for row, other in enumerate(others.tolist()):
            if other != RECORDING:
                heights = np.isfinite(self._plots[other].height_m)
                known[row] = heights.mean() >= AGREES_MIN
            polar[row] = other != RECORDING and self.is_radar(other)
        return np.asarray((own | known[at]) & (known[at] | ~polar[at]))

    def apart_m(self, first: int, later: int) -> float:
        """Return the horizontal distance of two sites, m."""
        sites = np.array([(*self.site(one)[:2], 0.0) for one in (first, later)])
        return float(np.linalg.norm(np.diff(geodetic_to_ecef(*sites.T), axis=0)))

    def period_s(self, number: int) -> float:
        """Return the configured scan period, s; NaN where unknown."""
        return float(self._sensors.rotation_period_s[number])

    def plots(self, number: int) -> Plots:
        """Return the plots that are retained of a sensor."""
        self.proceed()
        return self._plots[number]

    def tested(self, number: int) -> Plots:
        """Return the plots of a sensor that are compared."""
        return self.plots(number).thinned(TESTED_MAX)

    def tested_positions(self, number: int) -> Floats:
        """Return (n, 3) positions of `tested` as configured, ECEF, m."""
        return positions(self.tested(number), self.site_of_radar(number))

    def overlaps(self, number: int, others: Collection[int], late_s: float) -> bool:
        """Return whether a sensor with a clock error has time in common with others."""
        time_s = self._plots[number].time_s - late_s
        known = [self._plots[one].time_s for one in others if one != number]
        return any(time_s.min() <= other.max() and other.min() <= time_s.max() for other in known)

    def pairs(
        self,
        number: int,
        others: Collection[int],
        *,
        late_s: float = 0.0,
        reading: Reading = as_given,
        sites: Mapping[int, Site] | None = None,
    ) -> Pairs:
        """Return the positions by others of the aircraft of the tested plots of a sensor.

        Parameters
        ----------
        number : int
            The sensor.
        others : collection of int
            Sensors to compare with, beside the positions in the recording.
        late_s : float
            Time offset of the sensor: claimed time minus true time, s.
        reading : callable
            Interpretation of the columns of the other radars.
        sites : mapping, optional
            Sites of others that are not as configured.
        """
        plots = self.tested(number)
        asked = {one: self._plots[one] for one in others if one != number and one in self._plots}
        keys = keys_by_sensor(plots, asked)
        if keys is not None:
            paths = [
                (keys[one], self._named_paths(one, keys[one], reading, sites or {}))
                for one in sorted(asked)
            ]
            found = named_pairs(plots, paths, late_s)
        else:
            found = candidate_pairs(plots, self._paths(asked, reading, sites or {}), late_s)
        if not self.is_radar(number):
            return found
        return joined(recorded_pairs(plots), found)

    def paths_by(self, number: int, key: int) -> Paths:
        """Return the paths of a sensor as configured, by one of `KEYS`."""
        return self._named_paths(number, key, as_given, {})

    def agreement(self, number: int, pairs: Pairs) -> Agreement:
        """Return how well a sensor, as configured, agrees."""
        plots = self.tested(number)
        compared = len(np.unique(pairs.plot))
        if compared < TESTED_MIN:
            return NO_AGREEMENT._replace(compared=compared)
        if self.is_radar(number):
            measured = as_given(plots.range_m, plots.azimuth_deg)
            return polar_agreement(measured, self.site(number), pairs, compared=compared)
        return position_agreement(reported(plots), pairs, compared=compared)

    # Those of a sensor as configured are compared with every other sensor.
    def _named_paths(
        self, number: int, key: int, reading: Reading, sites: Mapping[int, Site]
    ) -> Paths:
        as_configured = reading is as_given and number not in sites
        if as_configured and (number, key) in self._paths_as_given:
            return self._paths_as_given[number, key]
        position_m = self._positions(number, reading, sites.get(number, self.site(number)))
        paths = named_paths(number, self._plots[number], position_m, key)
        if as_configured:
            self._paths_as_given[number, key] = paths
        return paths

    def _positions(self, number: int, reading: Reading, site: Site) -> Floats:
        plots = self._plots[number]
        if not self.is_radar(number):
            return positions(plots, None)
        return located(site, *reading(plots.range_m, plots.azimuth_deg), plots.heights())

    # The tracks of the run, by the plots of others that updated them.
    def _paths(self, asked: Collection[int], reading: Reading, sites: Mapping[int, Site]) -> Paths:
        measured = self._tracked.measured
        position = np.full((len(measured), 3), np.nan)
        for number in asked:
            rows = np.flatnonzero(measured.sensor == number)
            nothing = np.full((len(rows), 3), -1, np.int64)
            plots = Plots(
                measured.time_s[rows], measured.range_m[rows],
                np.degrees(measured.azimuth_rad[rows]), np.degrees(measured.latitude_rad[rows]),
                np.degrees(measured.longitude_rad[rows]), measured.height_m[rows], nothing,
            )  # fmt: skip
            if self.is_radar(number):
                site = sites.get(number, self.site(number))
                polar = reading(plots.range_m, plots.azimuth_deg)
                position[rows] = located(site, *polar, plots.heights())
            else:
                position[rows] = reported(plots)
        source = measured.sensor.astype(np.int64)
        return tracked_paths(source, self._tracked.track_id, measured.time_s, position)
