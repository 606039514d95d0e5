"""Diagnosis of a run, for `track` and `serve`.

Checks run in this order: names and times of sources, each sensor alone, each sensor against the
others. A cause is named where the plots show it; otherwise the losses are given with what to check.
"""

from collections.abc import Collection, Sequence

import numpy as np

from multiradar.diagnosis import losses as loss_checks
from multiradar.diagnosis import noise
from multiradar.diagnosis.cross_sensor.agreement import Agreement
from multiradar.diagnosis.cross_sensor.clocks import TIME_OF_SCAN, check_clock, check_late_positions
from multiradar.diagnosis.cross_sensor.comparison import (
    AGREES_MIN,
    TESTED_MIN,
    Comparison,
    configured_bias,
)
from multiradar.diagnosis.cross_sensor.contradictions import exchanged_sites, merge_contradiction
from multiradar.diagnosis.cross_sensor.explanations import (
    BY_RECORDING,
    anticlockwise,
    common_mistake,
    explain,
)
from multiradar.diagnosis.cross_sensor.heights import (
    CONVERTED_TWICE,
    HEIGHT_CODE,
    check_heights,
    of_heights,
)
from multiradar.diagnosis.cross_sensor.hypotheses import MIRRORED
from multiradar.diagnosis.cross_sensor.identities import (
    check_one_code,
    check_split_radars,
    check_unexplained,
)
from multiradar.diagnosis.cross_sensor.offsets import (
    OFFSET_CODE,
    check_azimuth_jumps,
    check_common_azimuth,
    check_large_offsets,
    check_offsets,
)
from multiradar.diagnosis.cross_sensor.radar_groups import grouped
from multiradar.diagnosis.cross_sensor.references import RECORDING, Pairs, are_named
from multiradar.diagnosis.cross_sensor.registration import check_registration
from multiradar.diagnosis.cross_sensor.site_errors import (
    JointFit,
    check_clock_errors,
    check_site_errors,
)
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.model import Diagnosis, first_of
from multiradar.diagnosis.names import SILENT_CODE, check_names, first_and_last, listed
from multiradar.diagnosis.same_aircraft.height_levels import check_height_levels
from multiradar.diagnosis.same_aircraft.identities_compared import (
    check_addresses,
    check_track_numbers,
)
from multiradar.diagnosis.same_aircraft.outages import check_gaps, check_outages
from multiradar.diagnosis.same_aircraft.pauses import check_pauses
from multiradar.diagnosis.single_sensor.alone import check_alone
from multiradar.diagnosis.single_sensor.columns import check_codes, check_time_rate
from multiradar.diagnosis.single_sensor.detections import SPARSE_CODE, check_all_detections
from multiradar.diagnosis.single_sensor.jumps import OTHER_ROWS, check_paths
from multiradar.diagnosis.single_sensor.settings import check_settings
from multiradar.diagnosis.times import (
    TIMES_APART,
    TIMES_JUMP,
    check_ends,
    check_times,
    utc,
)
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.estimation.measurement.sensors import PARAMETER_TIME_OFFSET, SensorTable

#: Fraction that agrees of a radar with a small error of site or range: less is another cause.
SOME_AGREE_MIN = 0.1
#: ... and that agrees without the estimated offsets, where these explain all that differs.
EXPLAINED_MIN = 0.8
_OTHER_TIMES = ("times_apart", TIMES_JUMP, "time_unit", "time_resolution")


def diagnose(evidence: Evidence) -> list[Diagnosis]:
    """Return the probable errors of configuration or data, by sensor.

    Parameters
    ----------
    evidence : Evidence
        Counts and plots of the run.

    Returns
    -------
    list of Diagnosis
        Empty when nothing is wrong; causes of names and times first.
    """
    found, comparison = check_names(evidence), Comparison(evidence)
    rate = check_time_rate(
        (comparison.plots(one), comparison.period_s(one))
        for one in comparison.numbers
        if comparison.is_radar(one)
    )
    if rate is not None:
        # Speeds, scans and gaps of all sensors would have other causes.
        return [*found, rate]
    times = _check_times(evidence)
    found += times
    if _are_of_either(times):
        return found
    found += loss_checks.check_copied_sensors(evidence)
    known = [name for name in evidence.sensors.ids if name in evidence.sources]
    found += _check_alone(evidence, comparison, known, {one.sensor_id for one in found})
    found = _with_origin(evidence, comparison, found)
    named = {one.sensor_id for one in found}
    # Wrong identities would be compared with those of other sensors.
    if numbers := check_track_numbers(comparison, evidence.sensors.ids, named):
        return [*found, *numbers]
    found += check_addresses(comparison, evidence.sensors.ids, named)
    named = {one.sensor_id for one in found}
    found += check_codes(evidence, named)
    named = {one.sensor_id for one in found}
    compared = [one for one in comparison.numbers if evidence.sensors.ids[one] not in named]
    jumps = check_azimuth_jumps(comparison, compared, evidence.sensors.ids)
    found += merge_contradiction(comparison, jumps, evidence.sensors.ids, len(compared))
    named |= {one.sensor_id for one in jumps}
    found += _check_against_others(evidence, comparison, named)
    named = {one.sensor_id for one in found}
    found += check_paths(comparison, evidence.sensors.ids, named)
    # A sensor without measurements disturbs no other.
    causes = any(one.severity == "error" and one.code != SILENT_CODE for one in found)
    named = {one.sensor_id for one in found}
    for name in known:
        if name not in named:
            found += check_settings(evidence, comparison, name, causes=causes)
    found = check_all_detections(comparison, evidence.sensors.ids, found)
    found = found or check_large_offsets(evidence, comparison)
    found = _with_all_of_one(evidence, found)
    found = _with_split(found, check_split_radars(comparison, evidence.sensors.ids))
    found += _placeholders(evidence, comparison, {one.sensor_id for one in found})
    if not evidence.confirmed and not found:
        found += _check_no_tracks(evidence)
    return [*found, *_check_ends(evidence, found)]


def _check_alone(
    evidence: Evidence, comparison: Comparison, known: Sequence[str], named: Collection[str]
) -> list[Diagnosis]:
    alone = [check_alone(evidence, comparison, one) for one in known if one not in named]
    return [one for found in alone for one in found]


def _check_times(evidence: Evidence) -> list[Diagnosis]:
    found = check_times(evidence.sources)
    named = {one.sensor_id for one in found}
    found += [one for one in check_gaps(evidence.sources) if one.sensor_id not in named]
    jumps = [] if found else check_pauses(evidence.sources)
    return [*found, *(one for one in jumps if one.code == TIMES_JUMP)]


# Two sensors that have no time in common are not compared.
def _are_of_either(found: Sequence[Diagnosis]) -> bool:
    return any(
        one.code == TIMES_APART and not one.sensor_id and one.severity == "error" for one in found
    )


def _check_ends(evidence: Evidence, found: Sequence[Diagnosis]) -> list[Diagnosis]:
    if _have_other_times(found):
        return []
    pauses = [*check_outages(evidence.sources), *check_pauses(evidence.sources)]
    # A clock that is ahead starts and ends later, and may leave a pause.
    clocks = any(one.code == "clock" and one.severity == "error" for one in found)
    if clocks:
        return [one for one in pauses if one.severity == "error"]
    return [*check_ends(evidence.sources), *pauses]


# Times that differ, jump or are coarse end at other times and have pauses, too.
def _have_other_times(found: Sequence[Diagnosis]) -> bool:
    return any(one.code in _OTHER_TIMES for one in found)


# A radar that alternates between two identifiers lacks the plots of the other one.
def _with_split(found: Sequence[Diagnosis], split: Sequence[Diagnosis]) -> list[Diagnosis]:
    names = {word for one in split for word in one.sentence.split()}
    return [one for one in found if one.code != SPARSE_CODE or one.sensor_id not in names] + [
        *split
    ]


# One radar has the identities of several places, and the others have no plots: all have its name.
def _with_all_of_one(evidence: Evidence, found: Sequence[Diagnosis]) -> list[Diagnosis]:
    silent = [one.sensor_id for one in found if one.code == SILENT_CODE]
    mixed = [one for one in found if one.code == OTHER_ROWS]
    radars = [
        name
        for name in evidence.sources
        if evidence.number(name) >= 0
        and evidence.sensors.kinds[evidence.number(name)] == KIND_RADAR
    ]
    if not silent or not radars or [one.sensor_id for one in mixed] != radars:
        return [*found]
    all_of_one = Diagnosis(
        radars[0],
        "two_radars",
        f"{radars[0]}: its plots are probably also those of {listed(silent)}, which "
        f"{'has' if len(silent) == 1 else 'have'} no measurements: successive plots with the same "
        "identity are too far apart to be of one aircraft seen from one site; give each radar its "
        "own sensor_id",
    )
    return [one for one in found if one not in mixed and one.code != SILENT_CODE] + [all_of_one]


# Codes that disturb no other check.
def _placeholders(
    evidence: Evidence, comparison: Comparison, named: Collection[str]
) -> list[Diagnosis]:
    asked = [one for one in comparison.numbers if evidence.sensors.ids[one] not in named]
    by_name = {evidence.sensors.ids[one]: comparison.site_of_radar(one) for one in asked}
    found = [
        check_one_code(name, evidence.sources[name].plots(), site) for name, site in by_name.items()
    ]
    return [one for one in found if one is not None]


# The rotation shows that azimuths are anticlockwise, and other sensors show from where, or that the
# antenna itself rotates anticlockwise.
def _with_origin(
    evidence: Evidence, comparison: Comparison, found: Sequence[Diagnosis]
) -> list[Diagnosis]:
    names, result = evidence.sensors.ids, []
    alike = [names.index(one.sensor_id) for one in found if one.code == MIRRORED.code]
    for one in found:
        if one.code != MIRRORED.code:
            result.append(one)
        elif _agrees_as_recorded(comparison, names.index(one.sensor_id), alike):
            result += check_alone(evidence, comparison, one.sensor_id, anticlockwise=True)
        else:
            of = anticlockwise(comparison, names.index(one.sensor_id), names, alike)
            result.append(of or one)
    return result


# Positions in the recording may have been computed from the same azimuths.
def _agrees_as_recorded(comparison: Comparison, number: int, alike: Collection[int]) -> bool:
    pairs = comparison.pairs(number, set(comparison.numbers) - set(alike))
    pairs = pairs.select(pairs.source != RECORDING)
    return comparison.agreement(number, pairs).share >= AGREES_MIN


# Each sensor against those that agree with each other.
def _check_against_others(
    evidence: Evidence, comparison: Comparison, named: Collection[str]
) -> list[Diagnosis]:
    names = evidence.sensors.ids
    numbers = [one for one in comparison.numbers if names[one] not in named]
    seen: dict[int, tuple[Agreement, Pairs]] = {}
    for number in numbers:
        pairs = comparison.pairs(number, numbers)
        seen[number] = comparison.agreement(number, pairs), pairs
    # Positions by wrong heights disturb all other comparisons.
    levels = check_height_levels(comparison, {one: seen[one][1] for one in numbers}, names)
    if any(one.severity == "error" for one in levels):
        return levels
    places = _check_places(evidence, comparison, numbers, seen)
    named = {one.sensor_id for one in places}
    return [*places, *(one for one in levels if one.sensor_id not in named)]


# Sites, clocks and units by the positions of the same aircraft.
def _check_places(
    evidence: Evidence,
    comparison: Comparison,
    numbers: list[int],
    seen: dict[int, tuple[Agreement, Pairs]],
) -> list[Diagnosis]:
    names = evidence.sensors.ids
    turned = check_common_azimuth(evidence)
    if turned and _are_more_than_two(evidence.sensors, turned):
        # Displaced sites would explain it, too, but by more numbers.
        return turned
    suspects = [one for one in numbers if seen[one][0].share < AGREES_MIN]
    suspects = _not_by_biases(evidence, suspects, numbers)
    trusted = [one for one in numbers if one not in suspects]
    exchanged = [] if trusted else exchanged_sites(comparison, suspects, names)
    found = exchanged or _explain_suspects(comparison, suspects, trusted, names)

    # An error of a suspect must not show up in the sensors it is compared with.
    def against(number: int, others: Collection[int]) -> Pairs:
        pairs = seen[number][1]
        return pairs.select(np.isin(pairs.source, [*others, RECORDING]))

    # Ranges a little too long disagree, too, and no single reading of the values explains them.
    explained = {one.sensor_id for one in found}
    asked = [*trusted]
    asked += [
        one
        for one in suspects
        if names[one] not in explained
        and seen[one][0].share >= SOME_AGREE_MIN
        and are_named(seen[one][1])
    ]
    compared = {
        one: (comparison.agreement(one, pairs), pairs)
        for one in asked
        for pairs in [against(one, asked)]
        if comparison.is_radar(one)
    }
    joint = [JointFit(evidence.sensors, comparison, one) for one in grouped(comparison, compared)]
    misplaced, of_sites = check_site_errors(evidence.sensors, joint)
    placed = [one for one in asked if one not in misplaced]
    found += [
        one
        for error in of_sites
        for number in [names.index(error.sensor_id)]
        for one in _instead_of_gain(comparison, error, number, against(number, placed))
    ]
    valid = [one for one in suspects if _is_valid(evidence, names[one])]
    found = found or check_unexplained(comparison, valid, trusted, names)
    trusted = [one for one in trusted if one not in misplaced]
    by_number = {
        one: _check_agreeing(evidence.sensors, comparison, one, against(one, trusted))
        for one in trusted
    }
    blamed = [one for one, wrong in by_number.items() if wrong]
    # Beside one time for each scan, the clocks of the others seem wrong.
    of_scans = [one for one in blamed if by_number[one][0].code == TIME_OF_SCAN]
    sound = [one for one in trusted if one not in (of_scans or blamed)]
    if len(blamed) > 1 and sound:
        # A wrong sensor biases the comparison of others: repeat against the sound ones.
        again = {
            one: _check_agreeing(evidence.sensors, comparison, one, against(one, sound))
            for one in blamed
            if one not in of_scans
        }
        by_number |= again if of_scans or any(again.values()) else {}
    for number, wrong in by_number.items():
        pairs = against(number, trusted)
        if not wrong and number not in blamed and comparison.is_radar(number):
            # Positions in a dump may have been computed from the same plots.
            others = comparison.agreement(number, pairs.select(pairs.source != RECORDING))
            if others.share >= AGREES_MIN:
                found += first_of(noise.check_spread(evidence, names[number], others.spread))
        found += wrong
    # An error of one sensor may appear as an offset, or another site height, of a second one.
    found = [one for one in found if one.code not in _MAY_BE_OF_OTHERS] or found
    if sum(one.code == "height_unit" for one in found) > 1:
        found = [one for one in found if CONVERTED_TWICE not in one.sentence]
    found = found or turned or check_clock_errors(evidence.sensors, joint)
    return exchanged or merge_contradiction(comparison, found, names, len(numbers))


# Offsets of two radars by one angle displace the site of one as seen from the other. Those that the
# run estimated are the simpler explanation, if they are usual.
def _not_by_biases(evidence: Evidence, suspects: list[int], numbers: list[int]) -> list[int]:
    if not suspects:
        return []
    corrected = Comparison(evidence, corrected=True)
    return [
        one
        for one in suspects
        if corrected.agreement(one, corrected.pairs(one, numbers)).share < EXPLAINED_MIN
    ]


def _are_more_than_two(sensors: SensorTable, found: Sequence[Diagnosis]) -> bool:
    numbers = [sensors.ids.index(one.sensor_id) for one in found]
    return len({(sensors.latitude_rad[one], sensors.longitude_rad[one]) for one in numbers}) > 2


def _explain_suspects(
    comparison: Comparison, suspects: list[int], trusted: list[int], names: tuple[str, ...]
) -> list[Diagnosis]:
    found = []
    if len(suspects) > 2 and not trusted:
        # One error of all is simpler than one of each.
        found += common_mistake(comparison, suspects, names)
    for number in suspects if not found else ():
        # Sensors that agree with no other are first compared with the positions in the recording.
        recorded = len(np.unique(comparison.pairs(number, ()).plot)) >= TESTED_MIN
        asked = trusted or ([] if recorded else suspects)
        why = explain(comparison, number, asked, names, agreeing=bool(trusted))
        if why is not None:
            where = "where other sensors detect aircraft" if asked else BY_RECORDING
            found.append(Diagnosis(names[number], why.code, why.sentence(names[number], where)))
    if suspects and not found:
        # Radars at one site agree with each other also where all are wrong.
        return common_mistake(comparison, [*suspects, *trusted], names)
    return found


# Rejected plots are retained, too, and agree with nothing.
def _is_valid(evidence: Evidence, name: str) -> bool:
    source = evidence.sources[name]
    return source.rejected.total() <= loss_checks.LOST_MAX * source.read


# Small differences of a sensor that agrees with others.
def _check_agreeing(
    sensors: SensorTable, comparison: Comparison, number: int, pairs: Pairs
) -> list[Diagnosis]:
    name = sensors.ids[number]
    agreement = comparison.agreement(number, pairs)
    found = first_of(check_heights(comparison, number, name, agreement, pairs))
    if not comparison.is_radar(number):
        return found or first_of(
            check_late_positions(comparison, number, name, pairs),
            noise.check_position_spread(sensors, number, agreement.spread),
        )
    if found:
        return found
    wrong = check_registration(comparison, number, agreement, pairs)
    others = [sensors.ids[one] for one in np.unique(pairs.source) if one != RECORDING]
    configured_s, _ = configured_bias(sensors, number, PARAMETER_TIME_OFFSET)
    return (
        of_heights(name, comparison.site(number)[2], wrong)
        or check_clock(name, wrong, configured_s, comparison.plots(number))
        or first_of(check_offsets(sensors, number, wrong, others))
    )


_MAY_BE_OF_OTHERS = (OFFSET_CODE, HEIGHT_CODE)


# Errors that depend on the height of the aircraft resemble a range gain.
def _instead_of_gain(
    comparison: Comparison, found: Diagnosis, number: int, pairs: Pairs
) -> list[Diagnosis]:
    if found.code != "range_gain":
        return [found]
    wrong = check_registration(comparison, number, comparison.agreement(number, pairs), pairs)
    return of_heights(found.sensor_id, comparison.site(number)[2], wrong) or [found]


def _check_no_tracks(evidence: Evidence) -> list[Diagnosis]:
    names = list(evidence.sources)
    read = sum(evidence.sources[name].read for name in names)
    first_s, last_s = first_and_last(evidence.sources, names)
    if read < TESTED_MIN:
        return []
    return [
        Diagnosis(
            "",
            "no_tracks",
            f"no track was confirmed from {read} measurements ({utc(first_s)} to {utc(last_s)}); "
            "check the sites in the sensors file, the units of ranges and azimuths, and the times",
        )
    ]
