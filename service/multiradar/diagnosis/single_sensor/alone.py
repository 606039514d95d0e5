"""Checks of a sensor that need no other."""

import numpy as np

from multiradar.diagnosis import losses as loss_checks
from multiradar.diagnosis import noise
from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.identities import check_identities
from multiradar.diagnosis.cross_sensor.plausibility import (
    aircraft_of,
    check_azimuth_unit,
    check_exchanged_columns,
    check_two_radars,
)
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.model import Diagnosis, first_of
from multiradar.diagnosis.motion.reports import check_minutes, check_nowhere
from multiradar.diagnosis.motion.vertical_rates import check_height_scatter, check_vertical_rates
from multiradar.diagnosis.plots import Plots, Site
from multiradar.diagnosis.scans import coherence_at
from multiradar.diagnosis.single_sensor.beams import check_azimuth_form
from multiradar.diagnosis.single_sensor.codes import check_decimal_codes, check_plot_numbers
from multiradar.diagnosis.single_sensor.columns import (
    check_constant,
    check_signed,
    check_time_resolution,
    check_time_unit,
)
from multiradar.diagnosis.single_sensor.height_units import (
    check_filled_heights,
    check_height_unit,
    of_feet,
)
from multiradar.diagnosis.single_sensor.jumps import check_jumps, check_shifted
from multiradar.diagnosis.single_sensor.steps import check_limits, check_rounded, check_wrapped

#: Coherence of azimuths and times of a rotating antenna, at least, also among clutter.
_ADVANCES_MIN = 0.5


def check_alone(
    evidence: Evidence, comparison: Comparison, name: str, *, anticlockwise: bool = False
) -> list[Diagnosis]:
    """Return the first error of a sensor that its own measurements show, else the first warning.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    comparison : Comparison
        Its plots.
    name : str
        The sensor.
    anticlockwise : bool
        Whether its antenna is known to rotate anticlockwise.
    """
    number, losses = evidence.number(name), loss_checks.losses_of(evidence, name)
    wrong = (
        loss_checks.check_kind(evidence, name, losses)
        or loss_checks.check_range_constant(evidence, name, losses)
        or check_decimal_codes(name, evidence.sources[name].plots()["mode_3a"])
    )
    if wrong is not None:
        return [wrong]
    if number not in comparison.numbers:
        return []
    plots = comparison.plots(number)
    if not comparison.is_radar(number):
        sigma_m = float(evidence.sensors.position_sigma_m[number])
        return first_of(
            check_nowhere(name, plots),
            check_identities(name, plots, None),
            check_shifted(name, plots),
            check_filled_heights(name, plots, None) or _of_reported_heights(name, plots),
            check_minutes(name, plots),
            check_rounded(name, plots, {"latitude_deg": sigma_m}),
            None
            if name in evidence.with_accuracy
            else noise.check_position_scatter(name, plots, aircraft_of(plots), sigma_m),
            _of_rates(name, plots, None),
        )
    sigmas = noise.sigmas(evidence, name)
    period_s = float(evidence.sensors.rotation_period_s[number])
    return first_of(
        check_limits(name, plots) or check_wrapped(name, plots) or check_constant(name, plots),
        # Speeds and times between plots of an aircraft rely on its identity.
        check_plot_numbers(name, plots),
        check_identities(name, plots, comparison.site(number)),
        check_time_unit(name, plots, period_s),
        check_exchanged_columns(name, plots)
        or (None if anticlockwise else check_azimuth_unit(name, plots, period_s))
        or (None if anticlockwise else check_azimuth_form(name, plots, period_s)),
        check_two_radars(name, plots),
        check_signed(name, plots),
        check_time_resolution(name, plots, period_s),
        check_rounded(name, plots, _of_columns(plots, period_s, sigmas)),
        check_filled_heights(name, plots, comparison.site(number))
        or check_height_unit(name, plots, comparison.site(number))
        or _of_rates(name, plots, comparison.site(number)),
    )


# The sigmas of the columns whose steps are those of rounding: counts modulo 360 are whole degrees,
# too, but do not advance with the antenna.
def _of_columns(plots: Plots, period_s: float, sigmas: tuple[float, float]) -> dict[str, float]:
    azimuth = np.radians(plots.azimuth_deg)
    turns = np.isnan(period_s) or (coherence_at(plots.time_s, azimuth, period_s) >= _ADVANCES_MIN)
    return {"range_m": sigmas[0]} | ({"azimuth_deg": sigmas[1]} if turns else {})


# One height of all aircraft is a placeholder in any unit.
def _of_reported_heights(name: str, plots: Plots) -> Diagnosis | None:
    heights = plots.height_m[np.isfinite(plots.height_m)]
    if len(heights) < TESTED_MIN or np.ptp(heights) == 0.0:
        return None
    return of_feet(name, heights)


# Heights by time, which rely on identities that are not those of other plots.
def _of_rates(name: str, plots: Plots, site: Site | None) -> Diagnosis | None:
    if check_jumps(name, plots, site) is not None:
        return None
    heights = plots.time_s, plots.height_m, aircraft_of(plots)
    coded = bool(np.mean(plots.keys[:, 1:].max(axis=1, initial=-1) >= 0) >= 0.5)
    return check_vertical_rates(name, *heights) or check_height_scatter(name, *heights, coded=coded)
