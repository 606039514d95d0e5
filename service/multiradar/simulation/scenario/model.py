"""A scenario: aircraft, sensors, their errors, a duration and a seed.

Positions are coordinates (east, north) on the plane of the scenario, and so are speeds and headings
(clockwise from the plane's north). On WGS 84 the centre of the plane lies on the ellipsoid, and a
position is the foot of the aircraft there. A bias is *measured minus true*. Times count from the
start of the scenario.
"""

from dataclasses import dataclass, field
from typing import Literal

from multiradar.estimation.measurement.known_biases import FRAME_PARAMETERS
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES
from multiradar.simulation.scenario.reported_data import Atmosphere, RegisterReports

SensorKind = Literal["radar", "direction-finder", "adsb", "mlat"]
#: Kinds of sensor with a site that measure an azimuth.
SITED = ("radar", "direction-finder")
PlaneKind = Literal["flat", "wgs84"]
#: What a sensor may report of an aircraft beside its position.
ReceivedField = Literal["height", "mode_3a", "mode_s_address", "track_number"]
RECEIVED_FIELDS: tuple[ReceivedField, ...] = ("height", "mode_3a", "mode_s_address", "track_number")

#: A range of values, from which one is drawn uniformly.
Span = tuple[float, float]

#: Number of kinds of bias parameter.
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
    """Errors of the reported positions of an aircraft during a period.

    Attributes
    ----------
    start_s, end_s : float
        Start and end of the period.
    east_m, north_m : float
        Offset at the start, in true metres.
    east_mps, north_mps : float
        Rate of change of the offset.
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
class Waypoints:
    """Waypoints of an aircraft, at least two.

    Attributes
    ----------
    time_s, east_m, north_m, height_m : tuple of float
        Times, ascending and at least 2 s apart, and positions on the plane of the scenario.
    """

    time_s: tuple[float, ...]
    east_m: tuple[float, ...]
    north_m: tuple[float, ...]
    height_m: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Aircraft:
    """One aircraft.

    Attributes
    ----------
    track_number : int
        Its number, by which truth and measurements are matched.
    east_m, north_m, height_m, speed_mps, heading_rad : float
        Initial state; ground speed.
    start_s, end_s : float
        Start and end of the flight; the scenario may end earlier.
    legs : tuple of Leg
        Flown in order, then straight flight.
    coupled : CoupledNoise, optional
        Random manoeuvres in place of legs.
    acceleration_density : float
        Spectral density of white acceleration on each axis, m²/s³, in place of both.
    waypoints : Waypoints, optional
        Waypoints in place of all of these: straight between them, as in recorded reports.
    mode_3a, mode_s_address : int, optional
        Identities in its replies.
    later_mode_3a : int, optional
        The code from `code_change_s` on.
    code_change_s : float
        Time of the code change.
    height_step_m : float
        Resolution of its reported height; 0 for the exact height.
    reports_height, reports_position : bool
        Whether radars receive its height, and ADS-B receives its position.
    report_errors : tuple of ReportError
        Errors of its ADS-B positions; they add up.
    exists : bool
        False for a ghost: only ADS-B reports it.
    transponder : bool
        Without it radars measure its position only, and ADS-B nothing.
    transponder_delay_m : float
        Range error of secondary radars by the turn-around time of its transponder, one way.
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
    waypoints: Waypoints | None = None
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
    transponder_delay_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Traffic:
    """Aircraft drawn at random from the seed of the scenario, each number uniformly from its span.

    Attributes
    ----------
    count : int
        Number of aircraft.
    east_m, north_m, height_m, speed_mps, heading_rad, start_s, life_s : Span
        Initial state, start time, flight duration.
    leg_s, turn_rate_rad_per_s, acceleration_mps2 : Span, optional
        With `leg_s`, legs of such durations follow each other until the end of the flight, a
        straight one after each turn; turns go to either side with one of the rates and
        accelerations.
    climb_mps : Span
        Straight legs climb or descend at one of these rates, within the span of heights.
    coupled, acceleration_density, height_step_m
        See `Aircraft`.
    heard_height_share, equipped_share : float
        Fraction of the aircraft with received heights, and with received ADS-B positions.
    transponder_delay_sigma_m : float
        Standard deviation of the delays of their transponders, each aircraft with its own.
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
    transponder_delay_sigma_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Bias:
    """One bias parameter: its truth, and the prior knowledge of the tracker.

    Attributes
    ----------
    value : float
        Its true value at the start: m, rad, 1 or s.
    drift : float
        Standard deviation of its random walk after one second.
    jump, jump_s : float
        Size and time of a jump.
    estimate : bool, optional
        Whether the tracker is to estimate it; without, by the kind of sensor.
    prior, prior_sigma, assumed_drift : float, optional
        Prior knowledge of the tracker; without, the tracker's own defaults, and the true drift.
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
    """A second network that carries the plots of a radar with its own rounding.

    Attributes
    ----------
    share : float
        Fraction of the plots that it carries.
    time_step_s, range_step_m, azimuth_step_rad : float
        Rounding steps; 0 for none.
    """

    share: float
    time_step_s: float = 0.0
    range_step_m: float = 0.0
    azimuth_step_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class ClutterBurst:
    """A clutter burst: a period in which a radar makes many more false plots.

    Attributes
    ----------
    start_s, end_s : float
        Start and end.
    plots_per_turn : float
        Mean number of them per scan, in addition to the constant clutter.
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
        Site; of a sensor of positions, the reference point of its frame.
    range_sigma_m, azimuth_sigma_rad, position_sigma_m : float
        Standard deviations of the random errors (position: each horizontal axis).
    rotation_period_s : float, optional
        Scan period of the antenna; a plot is made when the beam meets the aircraft.
    interval_s : float
        Without rotation: all aircraft are measured at multiples of this, simultaneously by radars,
        each aircraft at its own phase by ADS-B and multilateration.
    range_min_m, range_max_m, elevation_max_rad : float
        Coverage of a radar.
    earth_radius_factor : float, optional
        Factor of the effective radius of the Earth, by which ranges are refracted (WGS 84 only).
    horizon : bool
        Whether aircraft below the radio horizon are hidden (WGS 84 only).
    detection_probability, outlier_probability : float
        Probability of a plot per detection opportunity, and of an outlier per plot.
    height_probability, garbled_height_probability : float
        Probability that a measurement has a height, and that this height is garbled: off by some
        hundreds or thousands of feet.
    garbled_probability : float
        Probability that a received code has wrong digits.
    clutter_per_turn : float
        Mean number of clutter plots, without aircraft and identity, per scan (or interval).
    clutter_bursts : tuple of ClutterBurst
        Periods of dense clutter.
    second_feed : SecondFeed, optional
        Network that carries the plots of aircraft a second time.
    range_resolution_m, azimuth_resolution_rad : float
        A radar makes one plot of aircraft that are closer in both, where both are positive.
    gaps_s : tuple of (from, until)
        Periods without data.
    jammed_s : tuple of (from, until)
        Periods in which a radar loses the range of its plots.
    received : frozenset of str
        Fields it reports, of `RECEIVED_FIELDS`.
    biases : tuple of Bias
        One for each of `PARAMETER_NAMES`; the last ones may be absent.
    specified_biases : frozenset of int
        Bias parameters specified in the scenario.
    elevation_sigma_rad : float, optional
        Standard deviation of elevation errors; None for a direction finder that does not measure
        elevations.
    speed_mps, heading_rad : float, optional
        Initial speed and heading of a moving direction finder, from its site.
    legs : tuple of Leg
        Its legs, like those of aircraft.
    aircraft_data : RegisterReports, optional
        Registers that it receives.
    secondary : bool
        Whether the ranges of a radar include the delays of transponders.
    transponder_delay_sigma_m : float, optional
        Prior standard deviation with which the tracker estimates these delays; None if it does not.
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
    earth_radius_factor: float | None = None
    range_max_m: float = float("inf")
    elevation_max_rad: float = float("inf")
    horizon: bool = False
    detection_probability: float = 1.0
    outlier_probability: float = 0.0
    height_probability: float = 1.0
    garbled_height_probability: float = 0.0
    garbled_probability: float = 0.0
    clutter_per_turn: float = 0.0
    clutter_bursts: tuple[ClutterBurst, ...] = ()
    second_feed: SecondFeed | None = None
    range_resolution_m: float = 0.0
    azimuth_resolution_rad: float = 0.0
    gaps_s: tuple[Span, ...] = ()
    jammed_s: tuple[Span, ...] = ()
    received: frozenset[ReceivedField] = frozenset(RECEIVED_FIELDS)
    biases: tuple[Bias, ...] = (Bias(),) * PARAMETERS
    specified_biases: frozenset[int] = frozenset()
    elevation_sigma_rad: float | None = None
    speed_mps: float | None = None
    heading_rad: float = 0.0
    legs: tuple[Leg, ...] = ()
    aircraft_data: RegisterReports | None = None
    secondary: bool = True
    transponder_delay_sigma_m: float | None = None

    def __post_init__(self) -> None:
        absent = (Bias(),) * (PARAMETERS - len(self.biases))
        object.__setattr__(self, "biases", self.biases + absent)

    @property
    def has_frame(self) -> bool:
        """Whether biases of its local frame are specified."""
        return not self.specified_biases.isdisjoint(FRAME_PARAMETERS)

    @property
    def moves(self) -> bool:
        """Whether the sensor moves."""
        return self.speed_mps is not None


@dataclass(frozen=True, slots=True)
class Scenario:
    """A scenario: aircraft and sensors over a period.

    Attributes
    ----------
    title : str
        One sentence.
    seed : int
        Seed of the traffic, and of everything else in `multiradar simulate`.
    duration_s : float
        Duration.
    start_time_s : float
        Time stamp of the start.
    plane : str
        `flat` or `wgs84`.
    centre_rad : (latitude, longitude)
        Centre of the plane on WGS 84; a flat scenario is placed there on demand.
    aircraft, traffic, sensors : tuple
        Its contents; the traffic follows the aircraft.
    atmosphere : Atmosphere
        Wind, temperature and magnetic variation, of what aircraft report.
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
    atmosphere: Atmosphere = field(default_factory=Atmosphere)
