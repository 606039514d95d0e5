"""What a scene is: aircraft, sensors, their errors, a duration and a seed.

Places are coordinates (east, north) on the plane of the scene, and so are speeds and headings
(clockwise from the plane's north). On a flat plane they are all there is; a scene on WGS 84 has its
plane's centre on the ellipsoid, and a place is the foot of the aircraft there. A bias is *measured
minus true*. Times count from the beginning of the scene.
"""

from dataclasses import dataclass
from typing import Literal

from multiradar.estimation.measurement.sensors import PARAMETER_NAMES

SensorKind = Literal["radar", "direction-finder", "adsb", "mlat"]
#: Kinds that look from a site and measure an azimuth.
SITED = ("radar", "direction-finder")
PlaneKind = Literal["flat", "wgs84"]
#: What a sensor may hear of an aircraft beside its place.
Heard = Literal["height", "mode_3a", "mode_s_address", "track_number"]
HEARD: tuple[Heard, ...] = ("height", "mode_3a", "mode_s_address", "track_number")

#: A range of values, from which one is drawn evenly.
Span = tuple[float, float]

#: Number of kinds of bias parameter: range offset, azimuth offset, range gain, time offset.
PARAMETERS = len(PARAMETER_NAMES)


@dataclass(frozen=True, slots=True)
class Leg:
    """A part of a flight with a constant turn rate, longitudinal acceleration and climb."""

    duration_s: float
    turn_rate_rad_per_s: float = 0.0
    acceleration_mps2: float = 0.0
    climb_mps: float = 0.0


@dataclass(frozen=True, slots=True)
class ReportError:
    """What the positions that an aircraft reports are wrong by for a while.

    Attributes
    ----------
    start_s, end_s : float
        From when until when.
    east_m, north_m : float
        Offset at the start, in true metres.
    east_mps, north_mps : float
        By how much it grows.
    """

    start_s: float = 0.0
    end_s: float = float("inf")
    east_m: float = 0.0
    north_m: float = 0.0
    east_mps: float = 0.0
    north_mps: float = 0.0


@dataclass(frozen=True, slots=True)
class CoupledNoise:
    """Random changes of speed, course and climb angle: model (5) of Vasiliev and Mattis.

    Attributes
    ----------
    acceleration_sigma_mps2, course_rate_sigma_rad_per_s, climb_rate_sigma_rad_per_s : float
        Standard deviations a, ν_K and ν_φ of the rates of speed, course and climb angle.
    step_s : float
        Interval T of the model.
    """

    acceleration_sigma_mps2: float
    course_rate_sigma_rad_per_s: float
    climb_rate_sigma_rad_per_s: float = 0.0
    step_s: float = 1.0


@dataclass(frozen=True, slots=True)
class Way:
    """Places that an aircraft flies by one after the other, at least two.

    Attributes
    ----------
    time_s, east_m, north_m, height_m : tuple of float
        When, ascending and 2 s apart or more, and where on the plane of the scene.
    """

    time_s: tuple[float, ...]
    east_m: tuple[float, ...]
    north_m: tuple[float, ...]
    height_m: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Aircraft:
    """One aircraft from its birth to its death.

    Attributes
    ----------
    track_number : int
        Its number, by which truth and measurements are compared.
    east_m, north_m, height_m, speed_mps, heading_rad : float
        State at the birth; the speed is along the ground.
    start_s, end_s : float
        Birth and death; the scene may end before.
    legs : tuple of Leg
        Flown one after the other; then it goes straight on.
    coupled : CoupledNoise, optional
        Random manoeuvres in place of legs.
    acceleration_density : float
        Spectral density of a white acceleration on each axis, m²/s³, in place of both.
    way : Way, optional
        Where it flew, in place of all of these: straight from place to place, as a recording of
        reports leaves it.
    mode_3a, mode_s_address : int, optional
        Identities it answers with.
    later_mode_3a : int, optional
        The code it answers with from `code_change_s` on.
    code_change_s : float
        When it changes its code.
    height_step_m : float
        What it reports of its height is a multiple of this; 0 for the height itself.
    reports_height, reports_position : bool
        Whether radars hear its height, and ADS-B its position.
    report_errors : tuple of ReportError
        Errors of the positions that ADS-B hears of it; they add up.
    exists : bool
        An aircraft that does not is a ghost: only ADS-B hears of it.
    transponder : bool
        Without one radars measure its place alone, and ADS-B nothing.
    """

    track_number: int
    east_m: float
    north_m: float
    height_m: float
    speed_mps: float
    heading_rad: float
    start_s: float = 0.0
    end_s: float = float("inf")
    legs: tuple[Leg, ...] = ()
    coupled: CoupledNoise | None = None
    acceleration_density: float = 0.0
    way: Way | None = None
    mode_3a: int | None = None
    mode_s_address: int | None = None
    later_mode_3a: int | None = None
    code_change_s: float = float("inf")
    height_step_m: float = 0.0
    reports_height: bool = True
    reports_position: bool = True
    report_errors: tuple[ReportError, ...] = ()
    exists: bool = True
    transponder: bool = True


@dataclass(frozen=True, slots=True)
class Traffic:
    """Aircraft drawn at random from the seed of the scene, each number evenly from its span.

    Attributes
    ----------
    count : int
        How many.
    east_m, north_m, height_m, speed_mps, heading_rad, start_s, life_s : Span
        State at the birth, time of birth, time from birth to death.
    leg_s, turn_rate_rad_per_s, acceleration_mps2 : Span, optional
        Where `leg_s` is there, legs of such lengths follow each other until the death, a straight
        one after each turn; turns go either way at one of the rates, with one of the accelerations.
    climb_mps : Span
        Straight legs climb or descend at one of these rates, within the span of heights.
    coupled, acceleration_density, height_step_m
        As in `Aircraft`.
    heard_height_share, equipped_share : float
        Part of the aircraft whose height radars hear, and whose position ADS-B hears.
    """

    count: int
    east_m: Span
    north_m: Span
    height_m: Span
    speed_mps: Span
    heading_rad: Span
    start_s: Span = (0.0, 0.0)
    life_s: Span = (float("inf"), float("inf"))
    leg_s: Span | None = None
    turn_rate_rad_per_s: Span = (0.0, 0.0)
    acceleration_mps2: Span = (0.0, 0.0)
    climb_mps: Span = (0.0, 0.0)
    coupled: CoupledNoise | None = None
    acceleration_density: float = 0.0
    height_step_m: float = 0.0
    heard_height_share: float = 1.0
    equipped_share: float = 1.0


@dataclass(frozen=True, slots=True)
class Bias:
    """One bias parameter: what it is, and what the tracker is told of it beforehand.

    Attributes
    ----------
    value : float
        Its true value at the beginning: m, rad, 1 or s.
    drift : float
        Standard deviation of its random walk after one second.
    jump, jump_s : float
        By how much it jumps, and when.
    estimate : bool, optional
        Whether the tracker is to estimate it; without, as the kind of sensor says.
    prior, prior_sigma, assumed_drift : float, optional
        What the tracker is told; without, the tracker's own defaults, and the true drift.
    """

    value: float = 0.0
    drift: float = 0.0
    jump: float = 0.0
    jump_s: float = float("inf")
    estimate: bool | None = None
    prior: float = 0.0
    prior_sigma: float | None = None
    assumed_drift: float | None = None


@dataclass(frozen=True, slots=True)
class SecondFeed:
    """A second network that carries the plots of a radar, rounded in its own way.

    Attributes
    ----------
    share : float
        Part of the plots that come through it too.
    time_step_s, range_step_m, azimuth_step_rad : float
        What comes is a multiple of this; 0 leaves it as it is.
    """

    share: float
    time_step_s: float = 0.0
    range_step_m: float = 0.0
    azimuth_step_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Storm:
    """A time in which a radar makes many more plots without aircraft.

    Attributes
    ----------
    start_s, end_s : float
        From when until when.
    plots_per_turn : float
        Mean number of them a turn, beside the clutter of always.
    """

    start_s: float
    end_s: float
    plots_per_turn: float


@dataclass(frozen=True, slots=True)
class Sensor:
    """A radar, a direction finder, or receivers that report positions.

    Attributes
    ----------
    identifier : str
        Its name.
    kind : str
        `radar`, `direction-finder`, `adsb` or `mlat`.
    east_m, north_m, height_m : float
        Site; only radars and direction finders have one.
    range_sigma_m, azimuth_sigma_rad, position_sigma_m : float
        Standard deviations of the random errors (position: each horizontal axis).
    rotation_period_s : float, optional
        Time of a turn of the antenna; a plot is made as the beam meets the aircraft.
    interval_s : float
        Without rotation: all aircraft are measured at the multiples of this, at once by radars,
        each aircraft at its own phase by ADS-B and multilateration.
    range_min_m, range_max_m, elevation_max_rad : float
        Coverage of a radar.
    horizon : bool
        Whether the Earth hides what is below the radio horizon (WGS 84 only).
    detection_probability, outlier_probability : float
        Part of the looks that give a plot, and part of the plots that show nothing.
    height_probability, garbled_height_probability : float
        Part of the measurements that carry the height, and part of these heights that are garbled:
        off by some hundreds or thousands of feet.
    garbled_probability : float
        Part of the codes heard of which some digits are wrong.
    clutter_per_turn : float
        Mean number of plots without aircraft and identity a turn (or interval).
    storms : tuple of Storm
        Times of many such plots.
    second_feed : SecondFeed, optional
        What carries the plots of aircraft a second time.
    range_resolution_m, azimuth_resolution_rad : float
        A radar makes one plot of aircraft that are closer in both, where both are positive.
    gaps_s : tuple of (from, until)
        Times without data.
    jammed_s : tuple of (from, until)
        Times in which a radar loses the range of its plots.
    heard : frozenset of str
        What it hears of `HEARD`.
    biases : tuple of Bias
        One for each of `PARAMETER_NAMES`.
    told : frozenset of int
        Kinds of parameter that the scene speaks of.
    elevation_sigma_rad : float, optional
        Standard deviation of the errors of elevations; a direction finder that measures none has
        none.
    speed_mps, heading_rad : float, optional
        How a direction finder that moves does so at the beginning, at its site.
    legs : tuple of Leg
        How it goes on, as aircraft do.
    """

    identifier: str
    kind: SensorKind
    east_m: float = 0.0
    north_m: float = 0.0
    height_m: float = 0.0
    range_sigma_m: float = 50.0
    azimuth_sigma_rad: float = 0.0014
    position_sigma_m: float = 30.0
    rotation_period_s: float | None = None
    interval_s: float = 1.0
    range_min_m: float = 0.0
    range_max_m: float = float("inf")
    elevation_max_rad: float = float("inf")
    horizon: bool = False
    detection_probability: float = 1.0
    outlier_probability: float = 0.0
    height_probability: float = 1.0
    garbled_height_probability: float = 0.0
    garbled_probability: float = 0.0
    clutter_per_turn: float = 0.0
    storms: tuple[Storm, ...] = ()
    second_feed: SecondFeed | None = None
    range_resolution_m: float = 0.0
    azimuth_resolution_rad: float = 0.0
    gaps_s: tuple[Span, ...] = ()
    jammed_s: tuple[Span, ...] = ()
    heard: frozenset[Heard] = frozenset(HEARD)
    biases: tuple[Bias, ...] = (Bias(),) * PARAMETERS
    told: frozenset[int] = frozenset()
    elevation_sigma_rad: float | None = None
    speed_mps: float | None = None
    heading_rad: float = 0.0
    legs: tuple[Leg, ...] = ()

    @property
    def moves(self) -> bool:
        """Whether it is at another place at every moment."""
        return self.speed_mps is not None


@dataclass(frozen=True, slots=True)
class Scene:
    """Aircraft and sensors for a while.

    Attributes
    ----------
    title : str
        One sentence.
    seed : int
        The traffic is drawn from it, and all else in `multiradar simulate`.
    duration_s : float
        Length.
    start_time_s : float
        Time stamp of the beginning.
    plane : str
        `flat` or `wgs84`.
    centre_rad : (latitude, longitude)
        Where the centre of the plane lies on WGS 84; a flat scene is laid there on demand.
    aircraft, traffic, sensors : tuple
        What is in it; the traffic comes after the aircraft.
    """

    title: str
    seed: int
    duration_s: float
    plane: PlaneKind
    centre_rad: tuple[float, float]
    aircraft: tuple[Aircraft, ...]
    traffic: tuple[Traffic, ...]
    sensors: tuple[Sensor, ...]
    start_time_s: float = 0.0
