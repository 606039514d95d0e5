"""Settings of the tracker that its output depends on."""

from dataclasses import dataclass

#: How an aircraft may be taken to accelerate: `TrackingSettings.motion`.
WHITE_ACCELERATION = "white-acceleration"
VELOCITY_FRAME = "velocity-frame"
MOTIONS = (WHITE_ACCELERATION, VELOCITY_FRAME)
#: What `TrackingSettings.hidden_fields` may hold.
HIDEABLE = ("track_number", "mode_3a", "mode_s_address", "callsign")
#: How plots find their aircraft: `TrackingSettings.association`.
BY_NEAREST = "nearest"
BY_PROBABILITY = "probabilistic"
BY_IDENTITY = "identity"
ASSOCIATIONS = (BY_NEAREST, BY_PROBABILITY, BY_IDENTITY)
#: Which joint events count: `TrackingSettings.joint_events`.
LIKELIEST_EVENTS = "likeliest"
ALL_EVENTS = "all"
#: The interval that the accelerations of the velocity frame go with. Printed for one fixed
#: interval, they become densities by it, so that intervals may be cut anywhere.
NOMINAL_INTERVAL_S = 1.0
#: Bounds of `TrackingSettings.imm_modes`.
IMM_MODES_MIN, IMM_MODES_MAX = 3, 8


@dataclass(frozen=True, slots=True)
class TrackingSettings:
    """What the output of the tracker depends on, beside the measurements and the sensors.

    Attributes
    ----------
    filter_name : str
        `two-stage`, `imm`, `joint`, `blom`, `blom-macro` or `ci`.
    epoch_s : float
        Length of an epoch of data time: biases are published at its end.
    reorder_horizon_s : float
        Measurements are put in order of time within this horizon; what is later is rejected.
    acceleration_density : float
        Spectral density of the white acceleration of an aircraft, m²/s³ for each axis.
    motion : str
        `white-acceleration`, the same in every direction, or `velocity-frame`, along and across the
        velocity (Vasiliev and Mattis, equation (7)).
    longitudinal_acceleration_mps2, turn_rate_rad_per_s : float
        Standard deviations a and v_K of the velocity frame, of what stays for `NOMINAL_INTERVAL_S`.
    speed_sigma_mps : float
        Prior standard deviation of each component of the velocity of a new track.
    downweight_nis, refuse_nis : float
        Normalised innovation squared (two degrees of freedom) from which a measurement counts less,
        and from which it is refused.
    refusals_max : int
        After so many refusals in a row a track starts anew from the next measurement.
    cone_ratio : float
        Plots whose ground range is below this multiple of the height above the radar are refused
        (cone of silence: the azimuth means nothing there).
    assumed_height_m, assumed_height_sigma_m : float
        Height of an aircraft of which no height was heard, and its standard deviation: where it
        begins, until radars at several places tell it.
    exact_heights : bool
        Whether heights are taken for exact, and the last one for that of the aircraft for as long
        as none is heard. Else they come in steps of 25 or 100 ft, may be garbled, and give a rate
        of climb.
    ci_scale_time_s : float
        In the trace that covariance intersection minimises, which adds m² and (m/s)², a velocity
        counts as the way of so long a time.
    surprise_gain : float
        Weight of the newest measurement in the fading mean of half the normalised innovation
        squared, by which manoeuvres are noticed.
    surprise_floor : float
        Mean from which the process noise is raised: a straight flight has a mean of 1.
    manoeuvre_factor_max : float
        Largest factor of the process noise; 1 keeps it as it is.
    imm_modes : int
        Modes of motion of `imm`, 3 to 8: straight flight and turns both ways with one bank, two
        (from 5) or three (from 7); with an even number speeding up or slowing down too.
    imm_bank_deg : float
        The steepest bank; the gentlest of several has half its lateral acceleration, a single one
        three quarters. One bank serves all speeds.
    imm_straight_density, imm_turn_density, imm_speeding_density : float
        Spectral densities, m²/s³, of the acceleration: of straight flight, on each axis; across
        the velocity in a turn with the steepest bank, half of it with gentler ones; along the
        velocity while speeding up or slowing down.
    imm_straight_s, imm_manoeuvre_s : float
        Mean time for which an aircraft flies straight, and for which it keeps on manoeuvring.
    imm_surprise_floor, imm_surprise_density : float
        As `surprise_floor` and `acceleration_density` where no mode explains the measurements: the
        density, m²/s³, of which the raised noise is a multiple. It comes to the mode of changes of
        speed, or to all modes where there is none.
    association : str
        `nearest`: measurements without identity are assigned to tracks by place and by what they
        tell of identity, and begin tracks; `probabilistic`: so they are, and where tracks come
        close each is corrected by all plots that it may have, as likely as they are; `identity`:
        they have no aircraft.
    joint_events : str
        For `probabilistic`: `likeliest`, of all ways to give the same plots to the same tracks the
        likeliest alone counts, so that tracks do not run together (JPDA*); `all` (JPDA).
    range_resolution_m, azimuth_resolution_deg : float
        For `probabilistic`: a radar makes one plot of two aircraft that are so far apart, in either
        alone, half of the times; 0 where it always makes two.
    hidden_fields : tuple of str
        Of `HIDEABLE`: what is kept from the tracker; it goes to the output as it was measured.
    clutter_density_per_km2 : float
        Density of false plots of one turn, 1/km².
    speed_max_mps : float
        No aircraft is taken to be faster.
    manoeuvre_sigma_mps2 : float
        Standard deviation of the acceleration of a manoeuvre that begins after the last plot.
    confirm_score : float
        A track without identity is confirmed when the logarithm of its likelihood ratio to false
        plots has come to this.
    confirm_updates : int
        A track is confirmed with its update of this number, not before.
    coast_after_s, drop_after_s : float
        A track coasts, and ends, after this much data time without an update.
    """

    filter_name: str = "two-stage"
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
    imm_straight_s: float = 45.0
    imm_manoeuvre_s: float = 3000.0
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
