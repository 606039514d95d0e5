"""Track numbers and Mode S addresses of each sensor against those of others for the same aircraft.

The aircraft of a plot is that of the nearest path of the other sensor.
"""

from collections import Counter
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np
import polars as pl

from multiradar.diagnosis.cross_sensor.clocks import late_positions
from multiradar.diagnosis.cross_sensor.comparison import TESTED_MAX, TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.plausibility import SPEED_MIN_MPS, median_speed
from multiradar.diagnosis.cross_sensor.references import candidate_pairs, common_key
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.names import listed
from multiradar.diagnosis.plots import KEYS, Integers, positions

#: Identities of two sensors differ if at most this fraction of the plots of one has that of the
#: nearest path of the other, within this distance, m, and the plots of an identity are so often on
#: one path. Least number of identities.
SAME_MAX, PATH_M, ON_PATH_MIN, IDENTITIES_MIN = 0.4, 5000.0, 0.7, 5
#: A form explains identities if it does so for this fraction of the plots.
_FORM_MIN = 0.7
#: Rows by which a column of identities may be displaced, and what numbers may be truncated to.
_ROWS = (1, -1, 2, -2)
_MODULI = (65_536, 32_768, 16_384, 10_000, 8192, 4096, 2048, 1024, 1000, 512, 256, 100)
_TRACK_NUMBER, _ADDRESS = KEYS.index("track_number"), KEYS.index("mode_s_address")
_TEXTS = {_TRACK_NUMBER: "track numbers (track_number)", _ADDRESS: "addresses (mode_s_address)"}
_OCTETS = 24
# Around the box of all paths: a position farther from it is on none.
_BOX_M = PATH_M + 1.0
_NOTHING = np.empty(0, np.int64)


def check_track_numbers(
    comparison: Comparison, names: tuple[str, ...], named: Collection[str]
) -> list[Diagnosis]:
    """Diagnose track numbers that differ between sensors, such as those of each radar.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    names : tuple of str
        Identifiers of the sensors.
    named : collection of str
        Sensors with a diagnosis, which are not compared.

    Returns
    -------
    list of Diagnosis
        For each sensor whose numbers are not those of the most sensors.
    """
    return _check(comparison, names, named, _TRACK_NUMBER)


def check_addresses(
    comparison: Comparison, names: tuple[str, ...], named: Collection[str]
) -> list[Diagnosis]:
    """Diagnose Mode S addresses in another form, or of other aircraft, as `check_track_numbers`."""
    return _check(comparison, names, named, _ADDRESS)


def _check(
    comparison: Comparison, names: tuple[str, ...], named: Collection[str], key: int
) -> list[Diagnosis]:
    asked = [
        one
        for one in comparison.numbers
        if names[one] not in named
        and (comparison.plots(one).keys[:, key] >= 0).any()
        and not _are_still(comparison, one, key)
    ]
    alike = {
        pair: result
        for pair in combinations(asked, 2)
        if (result := _are_alike(comparison, *pair, key)) is not None
    }
    differ = {pair for pair, result in alike.items() if not result}
    if not differ:
        return []
    wrong = _wrong(asked, differ, Counter(one for pair in alike if alike[pair] for one in pair))
    right = [one for one in asked if one not in wrong]
    found = []
    for one in wrong:
        pair = next((pair for pair in differ if one in pair and set(pair) & set(right)), None)
        form = "" if pair is None else _form(comparison, pair, one, key)
        is_sure = len(right) > 1 or len(wrong) == 1 < len(asked) - 1
        than = listed([names[other] for other in right])
        found.append(_of_form(names[one], key, form, than, is_sure=is_sure))
    return found


# Whether the aircraft of a radar do not fly: its ranges are in a larger unit.
def _are_still(comparison: Comparison, number: int, key: int) -> bool:
    plots, site = comparison.plots(number), comparison.site_of_radar(number)
    if site is None:
        return False
    return median_speed(plots, plots.range_m, site, plots.keys[:, key]) < SPEED_MIN_MPS


# The sensors without which none differ: those first that differ from the most others, and agree
# with the fewest.
def _wrong(asked: list[int], differ: set[tuple[int, int]], alike: Counter[int]) -> list[int]:
    wrong: list[int] = []
    while differ:
        count = Counter(one for pair in differ for one in pair)
        wrong.append(max(count, key=lambda one: (count[one], -alike[one], asked.index(one))))
        differ = {pair for pair in differ if wrong[-1] not in pair}
    return sorted(wrong)


def _of_form(name: str, key: int, form: str, than: str, *, is_sure: bool) -> Diagnosis:
    head = f"{name}: its {_TEXTS[key]} are not those of {than} for the same aircraft"
    if form.startswith("with those"):
        return Diagnosis(
            name,
            "other_rows",
            f"{head}: the identities of its aircraft probably belong to other rows, {form}; check "
            "how the columns were joined",
        )
    if key == _TRACK_NUMBER and not form:
        return Diagnosis(
            name,
            "track_numbers",
            f"{name}: its track numbers (track_number) are not those of {than} for the same "
            "aircraft: it probably numbers its own tracks, so that each aircraft is tracked twice; "
            "leave track_number empty for sensors without the track numbers of a common system",
        )
    doubt = "" if is_sure else f" (or those of {than} are wrong)"
    why = f"they are probably {form}" if form else "they are those of other aircraft or in another "
    why += "" if form else "form"
    code = "track_numbers" if key == _TRACK_NUMBER else "addresses"
    return Diagnosis(
        name, code, f"{head}: {why}{doubt}; correct the column, or leave it empty"
    )  # fmt: skip


# Whether most plots of one sensor have the identity of the nearest path of another; False where
# nearly all differ and each is always on the same path, and None where neither is certain.
def _are_alike(comparison: Comparison, first: int, later: int, key: int) -> bool | None:
    if _are_near(comparison, first, later, key) or _is_late(comparison, first, later, key):
        return True
    if key != _TRACK_NUMBER and (same := _alike_by_number(comparison, first, later, key)):
        return same
    own, theirs, path = _matched(comparison, first, later, key)
    if len(own) < TESTED_MIN or len(np.unique(own)) < IDENTITIES_MIN:
        return None
    if np.mean(theirs == own) > SAME_MAX:
        return None
    counts = pl.DataFrame({"own": own, "path": path}).group_by("own", "path").len()
    most = counts.group_by("own").agg(pl.col("len").max())
    return None if int(most["len"].sum()) < ON_PATH_MIN * len(own) else False


# Whether most aircraft with one track number in two sensors have one identity, too.
def _alike_by_number(comparison: Comparison, first: int, later: int, key: int) -> bool:
    both = [comparison.plots(one).keys[:, [_TRACK_NUMBER, key]] for one in (first, later)]
    if not all((keys[:, 0] >= 0).any() for keys in both):
        return False
    own, theirs = (dict(keys.tolist()) for keys in both)
    known = [one for one in own if one >= 0 and own[one] >= 0 and theirs.get(one, -1) >= 0]
    same = sum(own[one] == theirs[one] for one in known)
    return len(known) >= IDENTITIES_MIN and same >= (1.0 - SAME_MAX) * len(known)


# Whether a wrong clock displaces each aircraft along the path with its own identity.
def _is_late(comparison: Comparison, first: int, later: int, key: int) -> bool:
    if common_key(comparison.tested(first), [comparison.plots(later)]) != key:
        return False
    pairs = comparison.pairs(first, [later])
    return bool(np.isfinite(late_positions(comparison, first, pairs)))


# Whether plots with the identity of a path are near it, except for one displacement: the site may
# be wrong.
def _are_near(comparison: Comparison, first: int, later: int, key: int) -> bool:
    plots = comparison.plots(first).thinned(TESTED_MAX)
    pairs = candidate_pairs(plots, comparison.paths_by(later, key), 0.0, plots.keys[:, key])
    if pairs.size < TESTED_MIN or 2 * pairs.size < plots.size:
        return False
    displaced_m = positions(plots, comparison.site_of_radar(first))[pairs.plot] - pairs.position_m
    off_m = np.linalg.norm(displaced_m - np.median(displaced_m, axis=0), axis=1)
    return bool(np.median(off_m) <= PATH_M)


# Own identity, that of the nearest path of another sensor, and the path, of each plot with both.
# With the identity of another row of the sensor.
def _matched(
    comparison: Comparison, first: int, later: int, key: int, rows: int = 0
) -> tuple[Integers, Integers, Integers]:
    whole = comparison.plots(first)
    if rows:
        whole = replace(whole, keys=np.roll(whole.keys, rows, axis=0))
    plots = whole.thinned(TESTED_MAX)
    paths = comparison.paths_by(later, key)
    if paths.size == 0:
        return _NOTHING, _NOTHING, _NOTHING
    # Of radars far from each other no plot is near a path, and of others few are.
    position_m = positions(plots, comparison.site_of_radar(first))
    least_m, most_m = paths.position_m.min(axis=0), paths.position_m.max(axis=0)
    within = (position_m >= least_m - _BOX_M) & (position_m <= most_m + _BOX_M)
    kept = within.all(axis=1) & (plots.keys[:, key] >= 0)
    plots, position_m = plots.select(kept), position_m[kept]
    names = plots.keys[:, key]
    pairs = candidate_pairs(plots, paths, 0.0)
    apart_m = np.linalg.norm(position_m[pairs.plot] - pairs.position_m, axis=1)
    order = np.lexsort((apart_m, pairs.plot))
    order = order[apart_m[order] <= PATH_M]
    nearest = order[np.flatnonzero(np.diff(pairs.plot[order], prepend=-1))]
    path = pairs.name[nearest]
    name_of_path = np.full(int(paths.path.max()) + 1, -1)
    name_of_path[paths.path] = paths.name
    return names[pairs.plot[nearest]], name_of_path[path], path


# In which form the identities of one sensor of a pair are those of the other; empty where unknown.
def _form(comparison: Comparison, pair: tuple[int, int], wrong: int, key: int) -> str:
    other = pair[0] if pair[1] == wrong else pair[1]
    for rows in _ROWS:
        own, theirs, _ = _matched(comparison, wrong, other, key, rows)
        if len(own) >= TESTED_MIN and (share := float(np.mean(own == theirs))) >= _FORM_MIN:
            where = "before" if rows > 0 else "after"
            steps = "the row" if abs(rows) == 1 else f"the {abs(rows)}nd row"
            return f"with those of {steps} {where}, {share:.0%} of its plots agree"
    own, theirs, _ = _matched(comparison, wrong, other, key)
    if len(own) == 0:
        # The paths of one sensor may be known where those of the other one are not.
        return ""
    forms: Mapping[str, Callable[[int], int]] = _ADDRESS_FORMS if key == _ADDRESS else {}
    for what, form in forms.items():
        if np.mean([form(one) == name for one, name in zip(theirs, own, strict=True)]) >= _FORM_MIN:
            return what
    for modulus in _MODULI:
        if np.mean(theirs % modulus == own) >= _FORM_MIN:
            return f"truncated (modulo {modulus})"
    (step, count), *_ = Counter((own - theirs).tolist()).most_common(1)
    return f"all {abs(step)} too {'large' if step > 0 else 'small'}" if (
        count >= _FORM_MIN * len(own)
    ) else ""  # fmt: skip


def _octets_reversed(address: int) -> int:
    return int.from_bytes(int(address).to_bytes(_OCTETS // 8, "little"), "big")


def _bits_reversed(address: int) -> int:
    return int(f"{int(address):0{_OCTETS}b}"[::-1], 2)


# Decimal digits that were read as hexadecimal ones.
def _decimal(address: int) -> int:
    return int(str(int(address))[-6:], 16)


_ADDRESS_FORMS: Mapping[str, Callable[[int], int]] = {
    "with their octets in reverse order": _octets_reversed,
    "with their bits in reverse order": _bits_reversed,
    "decimal instead of hexadecimal numbers": _decimal,
    "without their last digit": lambda address: int(address) >> 4,
    "shifted by a digit": lambda address: (int(address) << 4) & 0xFFFFFF,
}
