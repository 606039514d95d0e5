"""How many measurements of a sensor were lost, by what, and what that alone says."""

from collections import Counter
from typing import NamedTuple

import numpy as np

from multiradar.diagnosis.diagnosis import Diagnosis
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.names import counted
from multiradar.diagnosis.times import utc
from multiradar.estimation.filters.bank import Outcome

#: A sensor that loses a greater part of its measurements is diagnosed, from so many measurements.
LOST_MAX = 1.0 / 3.0
READ_MIN = 20
#: What is not lost: tracks are made of these, or nothing can be (the cone of silence), or a plot
#: waits for others like it (clutter).
_USED = (Outcome.UPDATED, Outcome.STARTED, Outcome.CONE_OF_SILENCE)
#: Units of range that range_max_m is given in by mistake, m.
_RANGE_MAX_UNITS = {"kilometres": 1000.0, "nautical miles": 1852.0}
_RANGE_MAX_FACTOR = 1.05
#: Measured noise over configured noise beyond which a sigma is wrong, and the other way round: the
#: tracker takes time to learn that there is less, and a hundredth shows as a tenth at first.
NOISE_FACTOR, NOISE_LOW_FACTOR = 5.0, 4.0
#: The settings of noise.
SIGMAS = ("range_sigma_m", "azimuth_sigma_deg")
#: What to look at for a loss that nothing explains, by what lost it.
_SETTINGS = {
    "TIME_LATE": "its clock, and reorder_horizon_s of the settings",
    "TIME_FUTURE": "its clock",
    "OUT_OF_RANGE": "range_max_m and the units of its columns",
    "MISSING_FIELD": "which columns its measurements fill",
    "UNKNOWN_KIND": "kind",
    "REFUSED": "its site, range_sigma_m, azimuth_sigma_deg and its clock",
    "RESTARTED": "its site, range_sigma_m, azimuth_sigma_deg and its clock",
    "UNASSOCIATED": "range_sigma_m, azimuth_sigma_deg and clutter",
    "UNLOCATABLE": "its site and the units of its columns",
    "IMPLAUSIBLE": "whether its reports are those of the aircraft that the radars see",
    "NO_ROOM": "the number of aircraft that the filter can track (--filter)",
    "UNSUPPORTED": "whether the filter takes this kind of measurement (--filter)",
}


class Losses(NamedTuple):
    """What became of the measurements of a sensor.

    Attributes
    ----------
    known : int
        Measurements of which it is known.
    lost : Counter
        Those that were lost, by reject code or outcome.
    duplicate : int
        Those that said what another one had said.
    """

    known: int
    lost: Counter[str]
    duplicate: int

    @property
    def share(self) -> float:
        """Part of the measurements that were lost."""
        return sum(self.lost.values()) / self.known if self.known else 0.0

    def words(self) -> str:
        """Return what was lost by what, the most first."""
        parts = [f"{counted(number)} {name}" for name, number in self.lost.most_common(3)]
        of_all = f"{self.share:.0%} of its {counted(self.known)} measurements"
        return f"{of_all} were lost ({', '.join(parts)})"


def losses_of(evidence: Evidence, name: str) -> Losses:
    """Return what became of the measurements of a sensor."""
    lost = Counter(evidence.sources[name].rejected)
    outcomes = evidence.outcomes_of(name)
    for number, count in enumerate(outcomes.tolist()):
        if count and Outcome(number) not in _USED:
            lost[Outcome(number).name] += count
    duplicate = evidence.duplicates[name]
    known = int(outcomes.sum()) + sum(evidence.sources[name].rejected.values()) + duplicate
    return Losses(known, lost, duplicate)


def wrong_kind(evidence: Evidence, name: str, losses: Losses) -> Diagnosis | None:
    """Say so where the measurements of a sensor are of another kind than it is declared."""
    if losses.lost["UNKNOWN_KIND"] <= LOST_MAX * losses.known:
        return None
    kinds = Counter(
        str(kind) for one in evidence.sources[name].kept for kind in one["kind"].to_list()
    )
    kind = kinds.most_common(1)[0][0]
    return Diagnosis(
        name,
        "kind",
        f"{name}: kind is probably wrong: its measurements are of the kind {kind}, which the kind "
        f"of the sensors file does not send; declare it as "
        f'kind = "{"direction-finder" if kind == "bearing" else kind}"',
    )


def range_end(evidence: Evidence, name: str, losses: Losses) -> Diagnosis | None:
    """Say so where a range_max_m refuses what is a range in a smaller unit."""
    if losses.lost["OUT_OF_RANGE"] <= LOST_MAX * losses.known:
        return None
    end_m = float(evidence.sensors.range_max_m[evidence.number(name)])
    ranges = evidence.sources[name].plots()["range_m"].drop_nulls().to_numpy()
    beyond = ranges > _RANGE_MAX_FACTOR * end_m
    if not np.isfinite(end_m) or np.mean(beyond) <= LOST_MAX:
        return None
    far = float(np.quantile(ranges, 0.999))
    units = [
        unit
        for unit, metres in _RANGE_MAX_UNITS.items()
        if end_m < 1000.0 and far <= _RANGE_MAX_FACTOR * end_m * metres
    ]
    guess = f" (in {units[0]}?)" if units else ""
    return Diagnosis(
        name,
        "range_max",
        f"{name}: range_max_m is probably wrong{guess}: it is {end_m:g} in the sensors file, and "
        f"{np.mean(beyond):.0%} of the plots are farther, up to {far:.0f} m; give it in metres",
    )


def noise_amiss(evidence: Evidence, name: str, *, causes: bool) -> Diagnosis | None:
    """Say so where the noise is far from the sigmas that are configured.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    name : str
        The sensor.
    causes : bool
        Whether something else is wrong: noise above its sigma may then be of that.
    """
    return _of_sigmas(name, [one for one in _by_noise(evidence, name, causes=causes) if one])


def spread_amiss(evidence: Evidence, name: str, spread: tuple[float, float]) -> Diagnosis | None:
    """Say so where plots scatter much less about what others see than a sigma allows for.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    name : str
        The radar.
    spread : (float, float)
        Standard deviation of the difference in range, m, and azimuth, rad; not less than the noise.
    """
    scatters = spread[0], float(np.degrees(spread[1]))
    units = " m", "°"
    found: list[_Amiss | None] = []
    for setting, sigma, scatter, unit in zip(
        SIGMAS, sigmas(evidence, name), scatters, units, strict=True
    ):
        words = f"its plots scatter by {_two_digits(scatter)}{unit} about what other sensors see"
        low = scatter < sigma / NOISE_FACTOR
        found.append(_Amiss(setting, "large", sigma, words) if low else None)
    if found == [None, None]:
        return None
    # The scatter holds the noise of others, too: the noise measured may show the other sigma.
    by_noise = _by_noise(evidence, name, causes=True)
    return _of_sigmas(name, [one for one in map(_either, found, by_noise) if one])


class _Amiss(NamedTuple):
    setting: str
    way: str
    sigma: float
    found: str


def _either(first: _Amiss | None, second: _Amiss | None) -> _Amiss | None:
    return first or second


# What the noise measured says of each sigma.
def _by_noise(evidence: Evidence, name: str, *, causes: bool) -> list[_Amiss | None]:
    ratios = evidence.noise.get(name, (np.nan, np.nan))
    found: list[_Amiss | None] = []
    for setting, sigma, ratio in zip(SIGMAS, sigmas(evidence, name), ratios, strict=True):
        wrong = ratio < 1.0 / NOISE_LOW_FACTOR or (ratio > NOISE_FACTOR and not causes)
        way = "large" if ratio < 1.0 else "small"
        words = f"the noise measured is {_two_digits(ratio)} times that"
        found.append(_Amiss(setting, way, sigma, words) if wrong else None)
    return found


def sigmas(evidence: Evidence, name: str) -> tuple[float, float]:
    """Return the sigmas of range, m, and azimuth, degrees, that are configured."""
    number, sensors = evidence.number(name), evidence.sensors
    return float(sensors.range_sigma_m[number]), float(
        np.degrees(sensors.azimuth_sigma_rad[number])
    )


def _of_sigmas(name: str, wrong: list[_Amiss]) -> Diagnosis | None:
    if not wrong:
        return None
    first, last = wrong[0], wrong[-1]
    if first is last:
        head, them = f"{first.setting} is probably too {first.way}", "it"
    elif first.way == last.way:
        head = f"{first.setting} and {last.setting} are probably too {first.way}"
        them = "them"
    else:
        head = f"{first.setting} is probably too {first.way} and {last.setting} too {last.way}"
        them = "them"
    text = f"it is {first.sigma:g} in the sensors file, and {first.found}"
    if first is not last:
        text = (
            f"{first.setting} is {first.sigma:g} in the sensors file, and {first.found}; "
            f"{last.setting} is {last.sigma:g}, and {last.found}"
        )
    return Diagnosis(name, "noise", f"{name}: {head}: {text}; correct {them} there")


def _two_digits(ratio: float) -> str:
    return f"{ratio:.0f}" if ratio >= 10.0 else f"{ratio:.2g}"


def twice(evidence: Evidence, name: str) -> Diagnosis | None:
    """Say so where measurements come twice, alike in everything."""
    plots = evidence.sources[name].plots()
    again = len(plots) - plots.n_unique()
    if len(plots) < READ_MIN or again <= LOST_MAX * len(plots):
        return None
    return Diagnosis(
        name,
        "measurements_twice",
        f"{name}: its measurements are probably in the recording twice: {again / len(plots):.0%} "
        "repeat another in everything; record or merge each only once",
    )


def unexplained(evidence: Evidence, name: str, losses: Losses) -> Diagnosis | None:
    """Say what was lost where no cause is found."""
    if losses.known < READ_MIN or losses.share <= LOST_MAX:
        return None
    most = losses.lost.most_common(1)[0][0]
    when = ""
    if most in ("TIME_LATE", "TIME_FUTURE"):
        source = evidence.sources[name]
        when = f" (its times: {utc(source.first_s)} to {utc(source.last_s)})"
    check = _SETTINGS.get(most, "its measurements in rejects.ndjson")
    return Diagnosis(
        name,
        "measurements_lost",
        f"{name}: {losses.words()}{when}, and no single mistake explains it; check {check}",
    )
