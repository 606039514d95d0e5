"""Air traffic of the world, as radars and ADS-B measure it, made block by block.

Aircraft fly great circles between airports, one leg after another, so their number in flight stays
the same. Every radar and every airport belongs to the region whose centre is nearest; each region
is the area of one service, with a system plane of its own.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from multiradar.geodesy.polar import slant_range_azimuth

#: Data time made at once, s; no radar has a shorter scan.
BLOCK_S = 4.0
#: Data time at the start, s.
START_S = 1_760_000_000.0
RANGE_SIGMA_M, AZIMUTH_SIGMA_DEG, POSITION_SIGMA_M = 40.0, 0.06, 15.0
#: Reports farther from the centre of their region have no receiver.
RECEIVED_MAX_M = 3.5e6
_EARTH_M = 6_371_000.0
#: Line of sight to the height h with refraction: 4120 m times the square root of h/m.
_SIGHT_M = 4120.0
_SITE_HEIGHT_M = 200.0
_CLIMB_MPS, _DESCENT_MPS = 10.0, 8.0
#: Fraction of legs to an airport of another region, and of detected aircraft.
_ABROAD, _DETECTED = 0.2, 0.97
#: Airports for each radar.
_AIRPORTS_EACH = 2

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Region(NamedTuple):
    """The area of one service: its centre, degrees, its radius, m, and its part of the traffic."""

    name: str
    latitude_deg: float
    longitude_deg: float
    radius_m: float
    share: float


#: The world, with a region across the antimeridian and one around the pole.
WORLD = (
    Region("north-america", 40.0, -95.0, 2.2e6, 0.30),
    Region("south-america", -15.0, -58.0, 2.2e6, 0.06),
    Region("europe", 49.0, 10.0, 1.6e6, 0.26),
    Region("africa", 2.0, 20.0, 2.4e6, 0.04),
    Region("south-asia", 24.0, 65.0, 2.2e6, 0.12),
    Region("east-asia", 28.0, 115.0, 2.0e6, 0.18),
    Region("pacific", -25.0, 176.0, 1.9e6, 0.03),
    Region("arctic", 87.0, 0.0, 1.1e6, 0.01),
)


class Radar(NamedTuple):
    """A radar: its region, site (degrees, m), scan, range and true biases (m, degrees)."""

    name: str
    region: int
    latitude_deg: float
    longitude_deg: float
    period_s: float
    range_max_m: float
    range_bias_m: float
    azimuth_bias_deg: float


@dataclass(slots=True)
class _Legs:
    # Of each aircraft: the arc from unit vector `begin` along the unit vector `along`.
    begin: Floats
    along: Floats
    started_s: Floats
    rate: Floats
    duration_s: Floats
    cruise_m: Floats
    region: Ints
    airport: Ints


class World:
    """Aircraft in flight and the radars that detect them; the same for the same seed.

    Parameters
    ----------
    aircraft, radars : int
        Their number.
    regions : sequence of Region
        Areas of the services.
    adsb_period_s : float
        Time between two reports of an aircraft, s.
    seed : int
        Seed of everything random.
    """

    def __init__(
        self, aircraft: int, radars: int, regions: tuple[Region, ...] = WORLD,
        adsb_period_s: float = 1.0, seed: int = 1,
    ) -> None:  # fmt: skip
        self.regions = regions
        self._random = np.random.Generator(np.random.PCG64(seed))
        self._centres = _unit(*np.array([one[1:3] for one in regions], np.float64).T)
        self.radars = self._sites(radars)
        self._radar_vectors = _unit(
            *np.array([(one.latitude_deg, one.longitude_deg) for one in self.radars]).T
        )
        counts = _shares(regions, max(2, _AIRPORTS_EACH * radars // len(regions)) * len(regions))
        placed = [self._around(one, count) for one, count in zip(regions, counts, strict=True)]
        self._airports, self._airport_region = (
            np.concatenate(placed),
            np.repeat(np.arange(len(regions)), counts),
        )
        home = np.repeat(np.arange(len(regions)), _shares(regions, aircraft))
        aircraft = len(home)
        nothing = np.zeros(aircraft)
        self._legs = _Legs(
            np.zeros((aircraft, 3)), np.zeros((aircraft, 3)), nothing.copy(), nothing.copy(),
            nothing.copy(), nothing.copy(), home, np.zeros(aircraft, np.int64),
        )  # fmt: skip
        everyone = np.arange(aircraft)
        self._legs.airport[:] = self._airport_of(home)
        self._depart(everyone, 0.0)
        self._legs.started_s -= self._random.uniform(0.0, self._legs.duration_s)
        self._phase = self._random.uniform(0.0, adsb_period_s, aircraft)
        self._adsb_period_s = adsb_period_s
        numbers = range(aircraft)
        self._addresses = pl.Series([f"{one + 0x100000:06x}" for one in numbers])
        self._codes = pl.Series([f"{one % 4096:04o}" for one in numbers])
        self._callsigns = pl.Series([f"W{one}" for one in numbers])

    def blocks(self, duration_s: float) -> Iterator[list[pl.DataFrame]]:
        """Yield the measurements of each region by ascending time, `BLOCK_S` at a time."""
        for begin_s in np.arange(0.0, duration_s, BLOCK_S).tolist():
            landed = self._legs.started_s + self._legs.duration_s < begin_s
            self._depart(np.flatnonzero(landed), begin_s)
            found = [*self._reports(begin_s), *self._plots(begin_s)]
            columns = [np.concatenate(parts) for parts in zip(*found, strict=True)]
            yield self._frames(columns)

    def sensors_text(self, region: int) -> str:
        """Return the `sensors.toml` of the service of a region."""
        own = [one for one in self.radars if one.region == region]
        radars = [
            f'[[sensor]]\nid = "{one.name}"\nkind = "radar"\nlatitude_deg = {one.latitude_deg:.6f}'
            f"\nlongitude_deg = {one.longitude_deg:.6f}\nheight_m = {_SITE_HEIGHT_M}\n"
            f"range_sigma_m = {RANGE_SIGMA_M}\nazimuth_sigma_deg = {AZIMUTH_SIGMA_DEG}\n"
            f"rotation_period_s = {one.period_s}\nrange_max_m = {one.range_max_m}\n"
            for one in own
        ]
        name = self.regions[region].name
        adsb = f'[[sensor]]\nid = "adsb-{name}"\nkind = "adsb"\n'
        return "\n".join([*radars, adsb + f"position_sigma_m = {POSITION_SIGMA_M}\n"])

    def positions(self, time_s: float) -> tuple[Floats, Floats, Floats]:
        """Return latitude, longitude (degrees) and height (m) of all aircraft."""
        every = np.arange(len(self._legs.rate))
        at, height_m = self._at(np.full(len(every), time_s), every)
        return *_degrees(at), height_m

    # ---------------------------------------------------------------- traffic

    def _sites(self, count: int) -> list[Radar]:
        random, radars = self._random, []
        for number, (region, own) in enumerate(
            zip(self.regions, _shares(self.regions, count), strict=True)
        ):
            latitude, longitude = _degrees(self._around(region, own))
            for k, place in enumerate(zip(latitude.tolist(), longitude.tolist(), strict=True)):
                en_route = random.uniform() < 0.6
                period_s, range_max_m = (10.0, 450e3) if en_route else (4.0, 160e3)
                range_bias_m, azimuth_bias_deg = random.normal(0.0, (60.0, 0.08)).tolist()
                radars.append(
                    Radar(
                        f"{region.name}-{k + 1}", number, round(place[0], 6), round(place[1], 6),
                        period_s, range_max_m, range_bias_m, azimuth_bias_deg,
                    )
                )  # fmt: skip
        return radars

    # Points of a region, dense at its centre.
    def _around(self, region: Region, count: int) -> Floats:
        centre = _unit(np.array([region.latitude_deg]), np.array([region.longitude_deg]))[0]
        east = np.cross([0.0, 0.0, 1.0], centre)
        east /= np.linalg.norm(east)
        north = np.cross(centre, east)
        turn = self._random.uniform(0.0, 2.0 * np.pi, count)[:, None]
        arc = region.radius_m / _EARTH_M * self._random.uniform(0.02, 1.0, count)[:, None] ** 0.7
        return np.asarray(
            np.cos(arc) * centre + np.sin(arc) * (np.cos(turn) * north + np.sin(turn) * east)
        )

    def _airport_of(self, region: Ints) -> Ints:
        first = np.searchsorted(self._airport_region, region)
        last = np.searchsorted(self._airport_region, region, "right")
        return np.asarray(self._random.integers(first, last), np.int64)

    # A new leg from where the last one ended.
    def _depart(self, who: Ints, time_s: float) -> None:
        legs, random = self._legs, self._random
        abroad = random.uniform(size=len(who)) < _ABROAD
        shares = np.array([one.share for one in self.regions])
        anywhere = random.choice(len(shares), len(who), p=shares / shares.sum())
        here = legs.airport[who]
        there = self._airport_of(np.where(abroad, anywhere, legs.region[who]))
        there = np.where(there == here, (here + 1) % len(self._airports), there)
        begin, end = self._airports[here], self._airports[there]
        cosine = np.clip(np.sum(begin * end, axis=1), -1.0, 1.0)
        along = end - cosine[:, None] * begin
        legs.begin[who], legs.airport[who] = begin, there
        legs.along[who] = along / np.linalg.norm(along, axis=1)[:, None]
        legs.region[who] = self._airport_region[there]
        legs.rate[who] = random.uniform(200.0, 260.0, len(who)) / _EARTH_M
        legs.duration_s[who] = np.arccos(cosine) / legs.rate[who]
        highest = legs.duration_s[who] / (1.0 / _CLIMB_MPS + 1.0 / _DESCENT_MPS)
        level = 304.8 * random.integers(28, 41, len(who))
        legs.cruise_m[who] = np.minimum(level, highest)
        legs.started_s[who] = time_s

    def _at(self, time_s: Floats, who: Ints) -> tuple[Floats, Floats]:
        legs = self._legs
        flown_s = time_s - legs.started_s[who]
        arc = (legs.rate[who] * flown_s)[:, None]
        left_s = np.maximum(legs.duration_s[who] - flown_s, 0.0)
        height = np.minimum(_CLIMB_MPS * np.maximum(flown_s, 0.0), _DESCENT_MPS * left_s)
        position = np.cos(arc) * legs.begin[who] + np.sin(arc) * legs.along[who]
        return position, np.minimum(height, legs.cruise_m[who])

    # ---------------------------------------------------------------- measurements

    # Region, radar (−1: a report), aircraft, time, and the two measured values of each.
    def _reports(self, begin_s: float) -> Iterator[tuple[NDArray[np.generic], ...]]:
        period_s = self._adsb_period_s
        first = np.ceil((begin_s - self._phase) / period_s)
        for more in range(int(np.ceil(BLOCK_S / period_s))):
            time_s = (first + more) * period_s + self._phase
            who = np.flatnonzero((time_s >= begin_s) & (time_s < begin_s + BLOCK_S))
            at, height_m = self._at(time_s[who], who)
            nearest = at @ self._centres.T
            region = np.argmax(nearest, axis=1)
            heard = np.max(nearest, axis=1) > np.cos(RECEIVED_MAX_M / _EARTH_M)
            heard &= height_m > 30.0
            latitude, longitude = _degrees(at)
            noise = self._random.normal(0.0, POSITION_SIGMA_M / 111_200.0, (2, len(who)))
            longitude += noise[1] / np.maximum(np.cos(np.radians(latitude)), 1e-3)
            measured = np.clip(latitude + noise[0], -90, 90), (longitude + 180.0) % 360.0 - 180.0
            columns = region, np.full(len(who), -1), who, time_s[who], *measured, height_m
            yield tuple(column[heard] for column in columns)

    def _plots(self, begin_s: float) -> Iterator[tuple[NDArray[np.generic], ...]]:
        every = np.arange(len(self._legs.rate))
        middle, height_m = self._at(np.full(len(every), begin_s + BLOCK_S / 2.0), every)
        tree = cKDTree(middle)
        sight_m = _SIGHT_M * (np.sqrt(height_m) + np.sqrt(_SITE_HEIGHT_M))
        for number, radar in enumerate(self.radars):
            near = tree.query_ball_point(
                self._radar_vectors[number], 2.0 * np.sin(radar.range_max_m / _EARTH_M / 2.0)
            )
            who = np.array(sorted(near), np.int64)
            chord = np.linalg.norm(middle[who] - self._radar_vectors[number], axis=1)
            who = who[chord * _EARTH_M < sight_m[who]]
            who = who[self._random.uniform(size=len(who)) < _DETECTED]
            if len(who):
                yield self._scan(number, radar, who, begin_s)

    # The antenna meets an aircraft at its azimuth, once in each scan.
    def _scan(
        self, number: int, radar: Radar, who: Ints, begin_s: float
    ) -> tuple[NDArray[np.generic], ...]:
        site = np.radians(radar.latitude_deg), np.radians(radar.longitude_deg), _SITE_HEIGHT_M
        middle = np.full(len(who), begin_s + BLOCK_S / 2.0)
        _, azimuth = self._polar(site, middle, who)[:2]
        part = azimuth / (2.0 * np.pi)
        scan = np.ceil(begin_s / radar.period_s - part)
        time_s = (scan + part) * radar.period_s
        met = time_s < begin_s + BLOCK_S
        who, time_s = who[met], time_s[met]
        range_m, azimuth, height_m = self._polar(site, time_s, who)
        count = len(who)
        range_m = range_m + radar.range_bias_m + self._random.normal(0.0, RANGE_SIGMA_M, count)
        noise_deg = self._random.normal(0.0, AZIMUTH_SIGMA_DEG, count)
        azimuth_deg = (np.degrees(azimuth) + radar.azimuth_bias_deg + noise_deg) % 360.0
        of_radar = np.full(count, radar.region), np.full(count, number)
        return (*of_radar, who, time_s, np.maximum(range_m, 100.0), azimuth_deg, height_m)

    def _polar(
        self, site: tuple[float, float, float], time_s: Floats, who: Ints
    ) -> tuple[Floats, Floats, Floats]:
        at, height_m = self._at(time_s, who)
        latitude, longitude = np.radians(_degrees(at))
        range_m, azimuth, _ = slant_range_azimuth(site, latitude, longitude, height_m)
        return range_m, azimuth, height_m

    def _frames(self, columns: list[NDArray[np.generic]]) -> list[pl.DataFrame]:
        region, radar, who = (column.astype(np.int64) for column in columns[:3])
        time_s, first, second, height_m = (column.astype(np.float64) for column in columns[3:])
        order = np.lexsort((radar, who, time_s, region))
        ends = np.searchsorted(region[order], np.arange(len(self.regions) + 1))
        names = pl.Series(
            [one.name for one in self.radars] + [f"adsb-{r.name}" for r in self.regions]
        )
        frames = []
        for at in range(len(self.regions)):
            rows = order[ends[at] : ends[at + 1]]
            reported = radar[rows] < 0
            source = np.where(reported, len(self.radars) + at, radar[rows])
            number = pl.Series(who[rows].astype(np.uint32))
            a, b = first[rows], second[rows]
            frame = pl.DataFrame(
                {
                    "time_s": START_S + np.round(time_s[rows], 4),
                    "sensor_id": names.gather(pl.Series(source.astype(np.uint32))),
                    "kind": pl.Series(["radar", "adsb"]).gather(
                        pl.Series(reported.astype(np.uint32))
                    ),
                    "range_m": np.where(reported, np.nan, np.round(a, 1)),
                    "azimuth_deg": np.where(reported, np.nan, np.round(b, 4) % 360.0),
                    "latitude_deg": np.where(reported, np.round(a, 6), np.nan),
                    "longitude_deg": np.where(reported, np.round(b, 6), np.nan),
                    "height_m": np.round(height_m[rows], 1),
                    "mode_3a": self._codes.gather(number),
                    "mode_s_address": self._addresses.gather(number),
                    "callsign": self._callsigns.gather(number),
                }
            )
            frames.append(frame.fill_nan(None))
        return frames


def continent(latitude_deg: float, longitude_deg: float, radius_m: float = 2.0e6) -> Region:
    """Return one region with all the traffic, for one service."""
    return Region("continent", latitude_deg, longitude_deg, radius_m, 1.0)


# Whole numbers in proportion to the shares; at least two each.
def _shares(regions: tuple[Region, ...], count: int) -> Ints:
    share = np.array([one.share for one in regions])
    edges = np.round(np.cumsum(share) / share.sum() * count).astype(np.int64)
    return np.maximum(np.diff(np.concatenate([[0], edges])), 2)


def _unit(latitude_deg: Floats, longitude_deg: Floats) -> Floats:
    latitude, longitude = np.radians(latitude_deg), np.radians(longitude_deg)
    return np.stack(
        [np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude),
         np.sin(latitude)], axis=1,
    )  # fmt: skip


def _degrees(vector: Floats) -> tuple[Floats, Floats]:
    latitude = np.degrees(np.arcsin(np.clip(vector[:, 2], -1.0, 1.0)))
    return latitude, np.degrees(np.arctan2(vector[:, 1], vector[:, 0]))
