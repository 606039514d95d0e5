"""The scorecard as tables for readers."""

from collections.abc import Mapping, Sequence
from typing import cast

from multiradar.evaluation.card.figures import Figure, Figures
from multiradar.evaluation.reference_checks import uncovered_rows
from multiradar.evaluation.scorecard import Scorecard
from multiradar.report.cells import NONE, estimate_texts, plain_text
from multiradar.report.content import Table, Value

_ERRORS = {
    "position_m": "position, m",
    "along_m": "along track, m",
    "across_m": "across track (right positive), m",
    "velocity_mps": "velocity, m/s",
    "speed_mps": "speed, m/s",
    "heading_deg": "heading, °",
    "height_m": "height, m",
    "climb_mps": "rate of climb, m/s",
}
_DEFINITIONS = (
    "Median, 95 % and largest refer to absolute values. Errors are evaluated at the times of "
    "measured updates."
)


def preset_table(figures: Figures) -> Table:
    """Return the requirements with the values found.

    Parameters
    ----------
    figures : dict
        Of `figures_of`.

    Returns
    -------
    Table
        A row for each requirement.
    """
    rows = []
    for one in _list(figures["presets"]):
        sign = "≥" if one["at_least"] else "≤"
        limit = f"{sign} {one['limit']:g} {one['unit']}"
        value = one["found"]
        found = None if value is None else f"{_number(value)} {one['unit']}"
        rows.append(
            (one["preset"], one["requirement"], limit, found, one["verdict"], one["samples"])
        )
    header = ("preset", "requirement", "limit", "found", "result", "samples")
    return Table("Presets", header, _cells(rows))


def card_tables(figures: Figures) -> list[Table]:
    """Return the tables of a scorecard, without presets and single aircraft.

    Parameters
    ----------
    figures : dict
        Of `figures_of`.

    Returns
    -------
    list of Table
        Errors, air picture, tracks, consistency; biases and forecasts where there are any.
    """
    tables = [_errors(figures), _air_picture(figures), _tracks(figures), _consistency(figures)]
    optional = {"differences": _differences, "biases": _biases, "forecasts": _forecasts}
    return [*tables, *(made(figures) for name, made in optional.items() if figures[name])]


def aircraft_table(figures: Figures, most: int | None = None) -> Table:
    """Return the figures of each aircraft, the largest errors first.

    Parameters
    ----------
    figures : dict
        Of `figures_of`.
    most : int, optional
        Maximum number of rows; all where not given.

    Returns
    -------
    Table
        Aircraft without any compared update come first.
    """
    rows = sorted(
        _list(figures["aircraft"]),
        key=lambda one: (one["rms_m"] is not None, -float(one["rms_m"] or 0.0)),
    )
    title = "Aircraft" if most is None or most >= len(rows) else f"The {most} worst aircraft"
    header = (
        "aircraft", "tracked", "tracks", "updates", "RMS, m", "median, m", "95 %, m",
        "along RMS, m", "across RMS, m", "delay, s", "longest gap, s",
    )  # fmt: skip
    names = (
        "aircraft", "completeness", "tracks", "updates", "rms_m", "median_m", "p95_m",
        "along_rms_m", "across_rms_m", "delay_s", "longest_gap_s",
    )  # fmt: skip
    cells = [
        tuple(_percent(one[name]) if name == "completeness" else one[name] for name in names)
        for one in rows[:most]
    ]
    return Table(title, header, _cells(cells))


def rejects_tables(figures: Figures, most: int | None = None) -> list[Table]:
    """Return the rejected rows of the reference.

    Parameters
    ----------
    figures : dict
        Of `figures_of`, with the `reference` of the command.
    most : int, optional
        Maximum number of rows; all that are listed where not given.

    Returns
    -------
    list of Table
        Empty without rejects.
    """
    reference = _dict(figures["reference"])
    listed, rows = _list(reference["rejects"]), _dict(reference["rows"])
    if not listed:
        return []
    cells = [
        (one["file"], one["offset"] if one["line"] is None else one["line"], one["aircraft"],
         one["reason"])
        for one in listed[:most]
    ]  # fmt: skip
    title = (
        f"Rejected reference rows ({rows['read']} read = {rows['accepted']} accepted + "
        f"{rows['rejected']} rejected + {rows['duplicate']} duplicate)"
    )
    return [Table(title, ("file", "row or line", "aircraft", "reason"), _cells(cells))]


def notes_of(card: Scorecard, figures: Figures) -> list[str]:
    """Return what a reader must know to interpret the figures, one sentence each.

    Parameters
    ----------
    card : Scorecard
        All measures.
    figures : dict
        Of `figures_of`, with the `reference` of the command.

    Returns
    -------
    list of str
        Plain text.
    """
    settings = card.settings
    notes = [
        f"Tracks are assigned to aircraft every {settings.step_s:g} s, by position alone, within "
        f"{settings.gate_m:g} m and at most {settings.age_max_s:g} s after the last update of the "
        "track.",
    ]
    if card.reference.velocity_mps is None:
        notes.append(
            "The reference is interpolated linearly: it cuts corners in turns, and its velocity "
            "is the mean velocity between reports; both effects are included in all errors."
        )
    if _dict(figures["reference"])["kind"] == "smoothed":
        notes.append(
            "The reference is computed from the same plots and biases as the tracks. The reference "
            "also uses later plots, but errors common to the reference and the tracks remain "
            "hidden."
        )
    if _dict(figures["reference"]).get("identity") == "tracks":
        notes.append(
            "The measurements have no identity: each is attributed to the aircraft of the track "
            "that it updated, so swaps, missed aircraft and false tracks cannot be detected."
        )
    if card.reference.counts.uncovered.total:
        notes.append(f"{uncovered_rows(card.reference.counts)}.")
    not_evaluated = _dict(figures["tracks"])["not_judged"]
    if not_evaluated:
        notes.append(
            f"{not_evaluated} tracks lie outside the reference, in time or position, and are "
            "not evaluated."
        )
    if settings.partial:
        notes.append(
            "The reference may be incomplete: tracks without a reference aircraft are not counted "
            "as false."
        )
    return notes


def _differences(figures: Figures) -> Table:
    rows = []
    for one in _list(figures["differences"]):
        what, unit = str(one["quantity"]).split("_")
        sigma = cast("float | None", one["sigma"])
        # Decimals of the standard deviation, or without one of the spread of one plot.
        least = cast("float", one["spread"]) / 10.0 if sigma is None else sigma
        texts = [
            estimate_texts(cast("float", one[name]), least)[0]
            for name in ("mean", "estimate", "left")
        ]
        rows.append(
            (
                one["sensor_id"], f"{what}, {'°' if unit == 'deg' else unit}", one["plots"],
                one["aircraft"], texts[0], None if sigma is None else estimate_texts(0.0, sigma)[1],
                one["spread"], texts[1], texts[2],
            )
        )  # fmt: skip
    header = (
        "sensor", "quantity", "plots", "aircraft", "difference", "sigma", "plot spread",
        "estimated bias", "remaining",
    )  # fmt: skip
    caption = (
        "Measured minus reference, over the plots of evaluated tracks, excluding outliers; the "
        "remaining difference is this difference minus the estimated bias. Sigma treats the plots "
        "of an aircraft as correlated."
    )
    return Table(
        "Radar range and azimuth compared with the reference", header, _cells(rows), caption
    )


def _errors(figures: Figures) -> Table:
    rows = []
    for name, label in _ERRORS.items():
        one = _dict(_dict(figures["errors"])[name])
        values = (one[key] for key in ("samples", "mean", "rms", "median", "p95", "largest"))
        rows.append((label, *values))
    header = ("error", "samples", "mean", "RMS", "median", "95 %", "largest")
    return Table("Errors", header, _cells(rows), _DEFINITIONS)


def _air_picture(figures: Figures) -> Table:
    siap, ospa, gospa = (_dict(figures[name]) for name in ("siap", "ospa", "gospa"))
    rows = [
        ("completeness", _percent(siap["completeness"]), "aircraft with a track"),
        ("ambiguity", _text(siap["ambiguity"], 4), "tracks per aircraft with a track"),
        ("spuriousness", _percent(siap["spuriousness"]), "spurious tracks"),
        ("positional accuracy", _unit(siap["positional_accuracy_m"], "m"), "mean distance"),
        ("velocity accuracy", _unit(siap["velocity_accuracy_mps"], "m/s"), "mean error"),
        ("track number changes", _unit(siap["number_changes_per_h"], "/h"), "of tracked time"),
        ("longest track segment", _percent(siap["longest_segment"]), "of the aircraft's time"),
        ("OSPA", _unit(ospa["mean_m"], "m"), _ospa_definition(ospa)),
        ("GOSPA", _unit(gospa["mean_m"], "m"), _gospa_definition(gospa)),
    ]
    return Table("Air picture (SIAP)", ("measure", "value", "definition"), _cells(rows))


def _ospa_definition(ospa: Figures) -> str:
    return f"mean; c = {ospa['cutoff_m']:g} m, p = {ospa['order']:g}"


def _gospa_definition(gospa: Figures) -> str:
    parts = (f"{name} {_percent(gospa[f'{name}_share'])}" for name in
             ("localisation", "missed", "false"))  # fmt: skip
    return f"mean; contribution to GOSPA^p: {', '.join(parts)}"


def _tracks(figures: Figures) -> Table:
    begin, continuity, identity, kinds = (
        _dict(figures[name]) for name in ("initiation", "continuity", "identity", "tracks")
    )
    rows = [
        ("aircraft never tracked", f"{begin['never_tracked']} of {begin['aircraft']}"),
        ("initiation delay, median", _unit(begin["median_s"], "s")),
        ("initiation delay, longest", _unit(begin["longest_s"], "s")),
        ("continuity", _percent(continuity["continuity"])),
        (f"gaps of {continuity['gap_s']:g} s or more", _count_and_fraction(continuity)),
        ("longest gap", _unit(continuity["longest_gap_s"], "s")),
        ("identity swaps", f"{identity['swaps']} ({_number(identity['swaps_per_h'])} per hour)"),
        ("track number changes", _number(identity["number_changes"])),
        ("plots on the correct track", _plots(identity)),
        ("false tracks", _with_longest(kinds, "false")),
        ("duplicate tracks", _with_longest(kinds, "duplicate")),
        ("tracks not evaluated", _number(kinds["not_judged"])),
    ]
    if "median_scans" in begin:
        scans = f"{_number(begin['median_scans'])}, longest {_number(begin['longest_scans'])}"
        rows.insert(3, ("initiation delay in scans, median", scans))
    return Table("Tracks", ("measure", "value"), _cells(rows))


def _count_and_fraction(continuity: Figures) -> str:
    fraction = _percent(continuity["gap_share"])
    return f"{continuity['gaps']} ({fraction} of {continuity['intervals']} intervals)"


def _with_longest(kinds: Figures, name: str) -> str:
    longest = kinds[f"{name}_longest_s"]
    return "0" if longest is None else f"{kinds[name]} (longest {_number(longest)} s)"


def _plots(identity: Figures) -> str | None:
    if not identity["plots_judged"]:
        return None
    return f"{_percent(identity['plots_on_right_track'])} of {identity['plots_judged']}"


def _consistency(figures: Figures) -> Table:
    rows = []
    for name, one in _dict(figures["nees"]).items():
        found = _dict(one)
        rows.append(
            (
                name,
                found["samples"],
                _text(found["mean"], 3),
                _percent(found["inside_95"]),
                _percent(found["bins_inside_95"]),
            )
        )
    header = (
        "NEES of", "samples", "mean", "inside the 95 % region", "means inside the 95 % band",
    )  # fmt: skip
    caption = (
        "The mean is per dimension: 1 if the reported covariance is correct, above 1 if it is too "
        "small."
    )
    return Table("Covariance consistency (NEES)", header, _cells(rows), caption)


def _biases(figures: Figures) -> Table:
    rows = [
        (
            one["sensor_id"],
            one["parameter"],
            *estimate_texts(cast(float, one["estimate"]), cast(float, one["sigma"])),
            *(_text(one[name], 4) for name in ("true", "error")),
            _text(one["error_over_sigma"], 3),
        )
        for one in _list(figures["biases"])
    ]
    header = ("sensor", "parameter", "estimate", "sigma", "true", "error", "error / sigma")
    return Table("Final bias estimates (measured − true)", header, _cells(rows))


def _forecasts(figures: Figures) -> Table:
    rows = [
        (
            one["by"],
            f"{one['horizon_s']:g} s",
            one["samples"],
            f"{_percent(one['inside'])} (nominal {_percent(one['probability'])})",
            *(_text(one[name], 3) for name in ("radius_median_m", "median_m", "rms_m", "nees")),
        )
        for one in _list(figures["forecasts"])
    ]
    header = (
        "method", "horizon", "samples", "containment", "median region radius, m",
        "median error, m", "RMS, m", "error² / sigma²",
    )  # fmt: skip
    caption = (
        "Regions are scaled according to earlier errors, so their containment is correct even if "
        "error² / sigma², computed with the unscaled covariance, differs from 1."
    )
    return Table("Forecasts", header, _cells(rows), caption)


def _dict(value: object) -> Figures:
    return cast(Figures, value)


def _list(value: object) -> list[Mapping[str, Figure]]:
    return cast(list[Mapping[str, Figure]], value)


def _cells(rows: Sequence[tuple[object, ...]]) -> tuple[tuple[Value, ...], ...]:
    return tuple(cast(tuple[Value, ...], row) for row in rows)


def _percent(value: object) -> str | None:
    return None if value is None else f"{plain_text(100.0 * cast(float, value), 4)} %"


def _unit(value: object, unit: str) -> str | None:
    return None if value is None else f"{_number(value)} {unit}"


def _text(value: object, digits: int) -> str | None:
    return None if value is None else plain_text(cast(float, value), digits)


def _number(value: object) -> str:
    return NONE if value is None else plain_text(cast(float, value), 4)
