"""Tables and notes of a registration, for the terminal and the HTML page."""

from collections.abc import Mapping, Sequence

from multiradar.report.cells import estimate_texts
from multiradar.report.content import Document, Plot, Table, Value
from multiradar.report.times import time_text
from multiradar.toolbox.pages.parameters import parameter_words
from multiradar_schemas.alignment import (
    AlignedBias,
    AlignedDistances,
    AlignedResiduals,
    Alignment,
)

#: Parameters with columns of their own; more have rows.
_SIDE_BY_SIDE = 2
#: Rows of the table by pair of sensors.
PAIRS_MAX = 60
_OBSERVED = 0.5


def alignment_document(found: Alignment, command: str, plots: Sequence[Plot] = ()) -> Document:
    """Return a registration as a report.

    Parameters
    ----------
    found : Alignment
        The figures.
    command : str
        The command line.
    plots : sequence of Plot
        Plots of the page.
    """
    tables = (_biases(found), _residuals(found), _radars(found), _pairs(found))
    return Document(
        title=f"Registration: {', '.join(_name(one.file) for one in found.inputs)}",
        summary=_summary(found),
        command=command,
        tables=[table for table in tables if table.rows],
        plots=plots,
        notes=_notes(found),
    )


def _summary(found: Alignment) -> str:
    own = found.residuals
    text = (
        f"{own.pairs:,} pairs of plots from two sensors within {found.pair_time_s:g} s, of "
        f"{own.aircraft:,} aircraft"
    )
    if own.before is not None and own.after is not None:
        text += (
            f": median distance {own.before.median_m:.0f} m as recorded, "
            f"{own.after.median_m:.0f} m after correction, for withheld aircraft"
        )
    counts = found.counts
    text += (
        f". Read {counts.read:,} measurements: accepted {counts.accepted:,}, rejected "
        f"{counts.rejected:,}, duplicate {counts.duplicate:,}; {found.tracks:,} confirmed tracks"
    )
    if found.first_s is None or found.last_s is None:
        return text
    return f"{text}; {time_text(found.first_s)} to {time_text(found.last_s)}"


def _name(files: str) -> str:
    return ", ".join(one.rsplit("/", 1)[-1] or one for one in files.split(", "))


def _biases(found: Alignment) -> Table:
    parameters = list(dict.fromkeys(one.parameter for one in found.biases))
    with_drift = any(one.drift_per_h is not None for one in found.biases)
    by_sensor: dict[str, dict[str, AlignedBias]] = {}
    for one in found.biases:
        by_sensor.setdefault(one.sensor_id, {})[one.parameter] = one
    rows: list[tuple[Value, ...]] = []
    if len(parameters) <= _SIDE_BY_SIDE:
        names = ["".join(parameter_words(name)) for name in parameters]
        header = ["sensor", *(part for name in names for part in _columns(name, with_drift))]
        for sensor, own in by_sensor.items():
            cells = [_bias(own.get(name), with_drift=with_drift) for name in parameters]
            rows.append((sensor, *(value for part in cells for value in part), _remarks(own)))
    else:
        header = ["sensor", "bias", *_columns("estimate", with_drift)]
        for one in found.biases:
            name = "".join(parameter_words(one.parameter))
            cells = [_bias(one, with_drift=with_drift)]
            rows.append((one.sensor_id, name, *cells[0], _remarks({one.parameter: one})))
    return Table(
        title="Biases",
        header=(*header, "remarks"),
        rows=tuple(rows),
        caption=(
            "Measured minus true. Sigma is computed from the scatter between aircraft. Not "
            "observed: sigma is more than half the prior sigma. Drifts: the slope exceeds four "
            "times its sigma; the estimate is then the mean over the recording."
        ),
    )


def _columns(name: str, with_drift: bool) -> list[str]:
    return [name, "sigma", *(["per hour"] if with_drift else [])]


def _bias(one: AlignedBias | None, *, with_drift: bool) -> list[Value]:
    if one is None:
        return [None, None, *([None] if with_drift else [])]
    row: list[Value] = [*map(_minus, estimate_texts(one.estimate, one.sigma))]
    if with_drift:
        drift, sigma = one.drift_per_h, one.drift_sigma_per_h
        row.append(
            None
            if drift is None or sigma is None
            else " ± ".join(map(_minus, estimate_texts(drift, sigma)))
        )
    return row


def _remarks(own: Mapping[str, AlignedBias]) -> str:
    words = {name: parameter_words(name)[0] for name in own}
    lines = [f"{words[name]} not observed" for name, one in own.items()
             if one.prior_ratio > _OBSERVED]  # fmt: skip
    lines += [f"{words[name]} drifts" for name, one in own.items() if one.drifts]
    return ", ".join(lines)


def _minus(text: str) -> str:
    return text.replace("-", "−")


def _row(own: AlignedResiduals) -> tuple[Value, ...]:
    return (
        float(own.pairs), float(own.aircraft),
        *(_metres(own.before, "median_m"), _metres(own.after, "median_m")),
        _metres(own.best, "median_m"),
        *(_metres(own.before, "rms_m"), _metres(own.after, "rms_m")),
        *(_metres(own.before, "percentile_90_m"), _metres(own.after, "percentile_90_m")),
    )  # fmt: skip


def _metres(of: AlignedDistances | None, name: str) -> Value:
    return None if of is None else f"{getattr(of, name):.0f}"


_HEADER = (
    "pairs", "aircraft", "median before, m", "median after, m", "floor, m", "RMS before, m",
    "RMS after, m", "90 % before, m", "90 % after, m",
)  # fmt: skip
_FLOOR = (
    "Distances between the two positions of a pair. Before: as recorded. After: corrected for "
    "biases estimated without the aircraft of the pair. Floor: corrected for biases estimated from "
    "the same aircraft; the remainder is random error."
)


def _residuals(found: Alignment) -> Table:
    return Table(
        title=f"Residuals of withheld aircraft ({found.folds} folds)",
        header=_HEADER,
        rows=(_row(found.residuals),),
        caption=_FLOOR,
    )


def _radars(found: Alignment) -> Table:
    rows = tuple(
        (
            one.sensor_id, float(one.residuals.pairs), float(one.residuals.aircraft),
            _metres(one.residuals.before, "median_m"), _metres(one.residuals.after, "median_m"),
            _metres(one.residuals.best, "median_m"),
            _text(one.range_before_m, "+z.0f"), _text(one.range_after_m, "+z.0f"),
            _text(one.range_noise_m, ".0f"),
            _text(one.azimuth_before_deg, "+z.3f"), _text(one.azimuth_after_deg, "+z.3f"),
            _text(one.azimuth_noise_deg, ".3f"),
        )
        for one in found.radars
    )  # fmt: skip
    return Table(
        title="Residuals by radar",
        header=(
            "radar", "pairs", "aircraft", "median before, m", "median after, m", "floor, m",
            "range before, m", "range after, m", "range noise, m", "azimuth before, °",
            "azimuth after, °", "azimuth noise, °",
        ),
        rows=rows,
        caption=(
            "Range and azimuth: median difference between the plots of the radar and the positions "
            "from the other sensors, which before correction include the biases of those sensors. "
            "Noise: estimated random error, 1 sigma."
        ),
    )  # fmt: skip


def _text(value: float | None, form: str) -> Value:
    # No sign of a rounded zero.
    return None if value is None else _minus(f"{value:{form}}")


def _pairs(found: Alignment) -> Table:
    ordered = sorted(found.pairs, key=lambda one: -one.residuals.pairs)
    left = len(ordered) - PAIRS_MAX
    return Table(
        title="Residuals by sensor pair",
        header=("sensors", *_HEADER),
        rows=tuple(
            (f"{one.first}, {one.second}", *_row(one.residuals)) for one in ordered[:PAIRS_MAX]
        ),
        caption=f"{left} sensor pairs with fewer plots are listed only with --json."
        if left > 0
        else "",
    )


def _notes(found: Alignment) -> list[str]:
    notes = [f"Not observable: {one.what} (sigma still {one.prior_ratio:.0%} of the prior)."
             for one in found.unobservable]  # fmt: skip
    notes += [f"{one[:1].upper()}{one[1:]}." for one in found.warnings]
    if not found.trend:
        notes.append(
            "The recording is too short for trends (at least two intervals of 300 s are needed)."
        )
    return notes
