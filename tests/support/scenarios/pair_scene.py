"""Plots of aircraft on straight lines by radars with biases, as an alignment has them."""

from dataclasses import dataclass, field

import numpy as np

from multiradar import wire
from multiradar.diagnosis.alignment.tracked_plots import TrackedPlots
from multiradar.diagnosis.cross_sensor.agreement import seen_from
from multiradar.diagnosis.plots import Floats
from multiradar.estimation.measurement.kinds import KIND_POSITION, KIND_RADAR
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation, geodetic_to_ecef
from multiradar_schemas.sensors.sensor import parse_sensors

#: Sites of radars: latitude and longitude, degrees; height, m.
SITES = {"A": (47.0, 8.0, 300.0), "B": (47.8, 9.2, 500.0), "C": (46.5, 9.5, 1500.0)}
RANGE_SIGMA_M, AZIMUTH_SIGMA_DEG, POSITION_SIGMA_M = 40.0, 0.06, 20.0
HEIGHT_M, SPEED_MPS, SPREAD_M = 9_000.0, 220.0, 100_000.0
_PERIODS_S = {"A": 4.0, "B": 5.0, "C": 6.0, "G": 1.0}


@dataclass(frozen=True)
class PairScene:
    """Sensors and aircraft.

    Attributes
    ----------
    biases : dict
        Range offset, m, azimuth offset, degree, range gain and time offset, s, by radar.
    estimated : tuple of str
        Further parameters that the sensors file estimates.
    reference : bool
        Whether there is ADS-B without biases.
    aircraft, duration_s : int, float
        Number, and length of the recording.
    drift_m_per_h : float
        Drift of the range offset of A.
    outliers : float
        Fraction of plots with a range up to 20 km off.
    eccentric_deg : (float, float)
        Azimuth sine and cosine of A.
    late_s : float
        Time offset of ADS-B.
    """

    biases: dict[str, tuple[float, float, float, float]]
    estimated: tuple[str, ...] = ()
    reference: bool = False
    aircraft: int = 30
    duration_s: float = 240.0
    drift_m_per_h: float = 0.0
    outliers: float = 0.0
    eccentric_deg: tuple[float, float] = (0.0, 0.0)
    late_s: float = 0.0
    sites: dict[str, tuple[float, float, float]] = field(default_factory=lambda: dict(SITES))

    def sensors(self) -> SensorTable:
        """Return the sensors."""
        text = ""
        for name in self.biases:
            latitude, longitude, height = self.sites[name]
            text += (
                f'[[sensor]]\nid = "{name}"\nkind = "radar"\nlatitude_deg = {latitude}\n'
                f"longitude_deg = {longitude}\nheight_m = {height}\n"
                f"range_sigma_m = {RANGE_SIGMA_M}\nazimuth_sigma_deg = {AZIMUTH_SIGMA_DEG}\n"
            )
            text += "".join(f"bias.{one} = {{ estimate = true }}\n" for one in self.estimated)
        if self.reference:
            text += '[[sensor]]\nid = "G"\nkind = "adsb"\n'
            text += f"position_sigma_m = {POSITION_SIGMA_M}\n"
            text += "bias.time_offset_s = { estimate = true }\n" * bool(self.late_s)
        return wire.sensor_table(parse_sensors(text))

    def plots(self, seed: int) -> TrackedPlots:
        """Return the plots by track and time."""
        generator = np.random.Generator(np.random.PCG64(seed))
        sensors = self.sensors()
        parts = [self._of_aircraft(number, sensors, generator) for number in range(self.aircraft)]
        names = TrackedPlots.__dataclass_fields__
        return TrackedPlots(
            **{name: np.concatenate([getattr(one, name) for one in parts]) for name in names}
        )

    def _seen(
        self, name: str, latitude: Floats, longitude: Floats, time_s: Floats,
        generator: np.random.Generator,
    ) -> tuple[Floats, Floats]:  # fmt: skip
        offset_m, offset_deg, gain, _ = self.biases[name]
        count = len(time_s)
        radians = np.radians(self.sites[name][:2])
        site = (float(radians[0]), float(radians[1]), self.sites[name][2])
        seen = seen_from(site, geodetic_to_ecef(latitude, longitude, np.full(count, HEIGHT_M)))
        drift_m = self.drift_m_per_h * time_s / 3600.0 if name == "A" else 0.0
        range_m = seen[0] * (1.0 + gain) + offset_m + drift_m
        range_m = range_m + generator.normal(0.0, RANGE_SIGMA_M, count)
        wild = generator.uniform(size=count) < self.outliers
        range_m = range_m + wild * generator.uniform(-20_000.0, 20_000.0, count)
        azimuth_deg = offset_deg + generator.normal(0.0, AZIMUTH_SIGMA_DEG, count)
        if name == "A":
            sine, cosine = self.eccentric_deg
            azimuth_deg = azimuth_deg + sine * np.sin(seen[1]) + cosine * np.cos(seen[1])
        return np.asarray(range_m), np.asarray(seen[1] + np.radians(azimuth_deg))

    def _of_aircraft(
        self, number: int, sensors: SensorTable, generator: np.random.Generator
    ) -> TrackedPlots:
        start = generator.uniform(-SPREAD_M, SPREAD_M, 2)
        course = generator.uniform(0.0, 2.0 * np.pi)
        velocity = SPEED_MPS * np.array([np.sin(course), np.cos(course)])
        names = [*self.biases, *(["G"] if self.reference else [])]
        columns: dict[str, list[Floats]] = {
            name: [] for name in ("sensor", "kind", "time_s", "range_m", "azimuth_rad",
                                  "latitude_rad", "longitude_rad", "place_lat", "place_lon",
                                  "true_s")
        }  # fmt: skip
        for name in names:
            index = sensors.ids.index(name)
            period_s = _PERIODS_S[name]
            time_s = np.arange(generator.uniform(0.0, period_s), self.duration_s, period_s)
            latitude, longitude = _on_line(start, velocity, time_s)
            nothing = np.full(len(time_s), np.nan)
            claimed_s = time_s
            measured = dict.fromkeys(
                ("range_m", "azimuth_rad", "latitude_rad", "longitude_rad"), nothing
            )
            if name == "G":
                claimed_s = time_s + self.late_s
                noise = generator.normal(0.0, POSITION_SIGMA_M, (2, len(time_s))) / 6.4e6
                measured["latitude_rad"] = latitude + noise[0]
                measured["longitude_rad"] = longitude + noise[1] / np.cos(latitude)
            else:
                measured["range_m"], measured["azimuth_rad"] = self._seen(
                    name, latitude, longitude, time_s, generator
                )
                late_s = self.biases[name][3]
                claimed_s = time_s + late_s
            columns["sensor"].append(np.full(len(time_s), index))
            kind = KIND_POSITION if name == "G" else KIND_RADAR
            columns["kind"].append(np.full(len(time_s), kind))
            columns["time_s"].append(claimed_s)
            for one, values in measured.items():
                columns[one].append(values)
            columns["true_s"].append(time_s)
            columns["place_lat"].append(latitude)
            columns["place_lon"].append(longitude)
        whole = {name: np.concatenate(parts) for name, parts in columns.items()}
        order = np.argsort(whole["time_s"], kind="stable")
        whole = {name: values[order] for name, values in whole.items()}
        count = len(order)
        return TrackedPlots(
            track_id=np.full(count, number + 1),
            aircraft=np.full(count, 1000 + number),
            sensor=whole["sensor"].astype(np.int32),
            kind=whole["kind"].astype(np.int8),
            time_s=whole["time_s"],
            range_m=whole["range_m"],
            azimuth_rad=whole["azimuth_rad"],
            latitude_rad=whole["latitude_rad"],
            longitude_rad=whole["longitude_rad"],
            height_m=np.full(count, HEIGHT_M),
            track_latitude_rad=whole["place_lat"],
            track_longitude_rad=whole["place_lon"],
            velocity_mps=_velocities(start, velocity, whole["true_s"]),
            velocity_variance=np.full(count, 9.0),
        )


def _on_line(start: Floats, velocity: Floats, time_s: Floats) -> tuple[Floats, Floats]:
    latitude, longitude = np.radians(SITES["A"][:2])
    local = np.column_stack([start + time_s[:, None] * velocity, np.zeros(len(time_s))])
    place = geodetic_to_ecef(latitude, longitude, 0.0) + local @ enu_rotation(latitude, longitude)
    found = ecef_to_geodetic(place)
    return found[0], found[1]


def _velocities(start: Floats, velocity: Floats, time_s: Floats) -> Floats:
    """Return velocities (n, 2) east and north at the aircraft."""
    places = [_on_line(start, velocity, time_s + step) for step in (-0.5, 0.5)]
    before, after = (geodetic_to_ecef(*place, np.full(len(time_s), HEIGHT_M)) for place in places)
    axes = enu_rotation(*_on_line(start, velocity, time_s))
    return np.asarray(np.einsum("kij,kj->ki", axes, after - before)[:, :2])
