"""Settings of the tracker that determine its output."""

from dataclasses import dataclass

#: Acceleration models: `TrackingSettings.motion`.
WHITE_ACCELERATION = "white-acceleration"
VELOCITY_FRAME = "velocity-frame"
#: Allowed values in `TrackingSettings.hidden_fields`.
HIDEABLE = ("track_number", "mode_3a", "mode_s_address", "callsign")
#: Association methods: `TrackingSettings.association`.
BY_NEAREST = "nearest"
BY_PROBABILITY = "probabilistic"
BY_IDENTITY = "identity"
#: Joint events considered: `TrackingSettings.joint_events`.
LIKELIEST_EVENTS = "likeliest"
#: Interval for which the accelerations of the velocity frame are defined, s. It converts them into
#: spectral densities, so that intervals may be divided anywhere.
NOMINAL_INTERVAL_S = 1.0
#: Bounds of `TrackingSettings.imm_modes`.
IMM_MODES_MIN, IMM_MODES_MAX = 3, 8
#: Scan period of sensors without a configured one, s.
DEFAULT_PERIOD_S = 5.0


@dataclass(frozen=True, slots=True)
class TrackingSettings:
    """Settings that determine the output, beside the measurements and the sensors.

    Attributes
    ----------
    filter_name : str
        `two-stage`, `imm`, `joint`, `blom`, `blom-macro` or `ci`.
    epoch_s : float
        Length of an epoch of data time: biases are published at its end.
    reorder_horizon_s : float
        Measurements are sorted by time within this horizon; later ones are rejected.
    acceleration_density : float
        Spectral density of the white acceleration of an aircraft, m²/s³ per axis.
    motion : str
        `white-acceleration`, isotropic, or `velocity-frame`, along and across the velocity
        (Vasiliev and Mattis, equation (7)).
    longitudinal_acceleration_mps2, turn_rate_rad_per_s : float
        Standard deviations a and v_K of the velocity frame, constant over `NOMINAL_INTERVAL_S`.
    speed_sigma_mps : float
        Prior standard deviation of each velocity component of a new track.
    downweight_nis, refuse_nis : float
        Normalised innovation squared (two degrees of freedom) from which a measurement is
        down-weighted, and from which it is rejected.
    refusals_max : int
        Number of consecutive rejections after which the next measurement reinitialises the track.
    cone_ratio : float
        Plots whose ground range is below this multiple of the height above the radar are rejected
        (cone of silence: the azimuth is unusable there).
    assumed_height_m, assumed_height_sigma_m : float
        Initial height of an aircraft without a received height, and its standard deviation, until
        several radars determine it.
    exact_heights : bool
        Whether heights are treated as exact and kept until the next one is received. Otherwise they
        have a resolution of 25 or 100 ft, may be garbled, and give a rate of climb.
    ci_scale_time_s : float
        Time by which velocities are weighted in the trace minimised by covariance intersection,
        which adds m² and (m/s)².
    surprise_gain : float
        Weight of the newest measurement in the fading mean of half the normalised innovation
        squared, used for manoeuvre detection.
    surprise_floor : float
        Mean from which the process noise is increased; it is 1 in straight flight.
    manoeuvre_factor_max : float
        Largest factor of the process noise; 1 switches the increase off.
    imm_modes : int
        Motion modes of `imm`, 3 to 8: straight flight and turns both ways with one bank, two (from
        5) or three (from 7); with an even number also a change of speed.
    imm_bank_deg : float
        Steepest bank. The shallowest of several has half its lateral acceleration, a single one
        three quarters. The bank does not depend on the speed.
    imm_straight_density, imm_turn_density, imm_speeding_density : float
        Spectral densities, m²/s³, of the acceleration: per axis in straight flight; across the
        velocity in a turn with the steepest bank (half of it with shallower ones); along the
        velocity in the speed change mode.
    imm_straight_s, imm_manoeuvre_s : float
        Mean duration of straight flight and of a manoeuvre.
    imm_speeding_share : float
        Fraction of the manoeuvres that are changes of speed, in models that have the mode; turns
        share the others equally.
    imm_surprise_floor, imm_surprise_density : float
        As `surprise_floor` and `acceleration_density`, where no mode explains the measurements: the
        density, m²/s³, whose multiple is added. It is added to the speed change mode, or to all
        modes without one.
    association : str
        `nearest`: measurements without identity are assigned to tracks by position and partial
        identity, and initiate tracks; `probabilistic`: the same, but closely spaced tracks are
        updated by all plots in their gates, weighted by probability (JPDA); `identity`:
        measurements without identity have no track.
    joint_events : str
        For `probabilistic`: `likeliest` counts, of all events with the same plots and tracks, only
        the likeliest, which avoids track coalescence (JPDA*); `all` (JPDA).
    range_resolution_m, azimuth_resolution_deg : float
        For `probabilistic`: separation in either coordinate at which a radar resolves two aircraft
        in half of the scans; 0: always resolved.
    hidden_fields : tuple of str
        Of `HIDEABLE`: fields that the tracker does not use; they are passed to the output as
        measured.
    clutter_density_per_km2 : float
        Density of false plots per scan, 1/km².
    speed_max_mps : float
        Maximum speed of aircraft.
    manoeuvre_sigma_mps2 : float
        Standard deviation of the acceleration of a manoeuvre that begins after the last plot.
    confirm_score : float
        Logarithm of the likelihood ratio to false plots at which a track without identity is
        confirmed.
    confirm_updates : int
        Minimum number of updates of a confirmed track.
    coast_after_s, drop_after_s : float
        Data time without an update after which a track coasts, and after which it is dropped.
    """

    filter_name: str = "imm"
    epoch_s: float = 4.0
    reorder_horizon_s: float = 6.0
    acceleration_density: float = 4.0
    motion: str = WHITE_ACCELERATION
    longitudinal_acceleration_mps2: float = 1.0
    turn_rate_rad_per_s: float = 0.01
    speed_sigma_mps: float = 300.0
    downweight_nis: float = 30.0
    refuse_nis: float = 100.0
    refusals_max: int = 3
    cone_ratio: float = 1.0
    assumed_height_m: float = 8000.0
    assumed_height_sigma_m: float = 3000.0
    exact_heights: bool = False
    ci_scale_time_s: float = 10.0
    surprise_gain: float = 0.4
    surprise_floor: float = 1.5
    manoeuvre_factor_max: float = 300.0
    imm_modes: int = 8
    imm_bank_deg: float = 25.0
    imm_straight_density: float = 0.003
    imm_turn_density: float = 8.0
    imm_speeding_density: float = 120.0
    imm_straight_s: float = 60.0
    imm_manoeuvre_s: float = 3000.0
    imm_speeding_share: float = 0.2
    imm_surprise_floor: float = 3.0
    imm_surprise_density: float = 256.0
    association: str = BY_NEAREST
    joint_events: str = LIKELIEST_EVENTS
    range_resolution_m: float = 200.0
    azimuth_resolution_deg: float = 2.0
    hidden_fields: tuple[str, ...] = ()
    clutter_density_per_km2: float = 1e-5
    speed_max_mps: float = 700.0
    manoeuvre_sigma_mps2: float = 6.0
    confirm_score: float = 10.0
    confirm_updates: int = 3
    coast_after_s: float = 15.0
    drop_after_s: float = 60.0
