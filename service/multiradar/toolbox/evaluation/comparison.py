"""Tracks compared with a reference."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from multiradar.errors import ArgumentError, DataWarning, InputError
from multiradar.toolbox.messages.warning import warn
from multiradar_schemas.documents.names import unknown

if TYPE_CHECKING:
    import polars as pl

    from multiradar.evaluation.card.figures import Figures
    from multiradar.evaluation.coverage import CoveredRegion
    from multiradar.evaluation.scorecard import Scorecard
    from multiradar.evaluation.settings import EvaluationSettings
    from multiradar.evaluation.trajectories import Tracks
    from multiradar.toolbox.evaluation.known import Known
    from multiradar_schemas.sensors.sensor import Sensor

#: Motion models of a smoothed reference; the first is the default.
SMOOTHERS = ("constant-velocity", "imm")


@dataclass(frozen=True, slots=True)
class References:
    """What tracks are compared with, as files; see `evaluate`."""

    truth: Path | None
    adsb: Path | None
    smoothed: Path | None
    system_tracks: Path | None
    processor: str | None
    sensors: Path | None
    measurements: Path | None
    smoother: str | None

    def check(self, *, density: float | None = None) -> None:
        """Check that exactly one reference is given, and no option that it does not use.

        Parameters
        ----------
        density : float, optional
            The density of a smoothed reference, if it is given.

        Raises
        ------
        ArgumentError
            There are none or several.
        """
        options = {
            "truth": self.truth,
            "adsb": self.adsb,
            "smoothed": self.smoothed,
            "system_tracks": self.system_tracks,
        }
        given = [name for name, one in options.items() if one is not None]
        others = [name for name in given if name != "truth"]
        # The truth of a dump may accompany another reference.
        if len(given) != 1 and not (len(others) == 1 and self._recorded()):
            if given:
                named = " and ".join(f"`{name}`" for name in given)
                raise ArgumentError(f"expected exactly one reference, found {named}", *given)
            known = ", ".join(f"`{name}`" for name in options)
            raise ArgumentError(f"missing reference: one of {known}", *options)
        if self.smoothed is None and self.smoother is not None:
            raise ArgumentError("`smoother` applies to `smoothed` only", "smoother", "smoothed")
        if self.smoothed is None and density is not None:
            raise ArgumentError("`density` applies to `smoothed` only", "density", "smoothed")
        if self.smoother is not None and self.smoother not in SMOOTHERS:
            msg = f"`smoother`: {unknown('smoother', self.smoother, SMOOTHERS)}"
            raise ArgumentError(msg, "smoother")
        if self.system_tracks is None and self.processor is not None:
            msg = "`processor` applies to `system_tracks` only"
            raise ArgumentError(msg, "processor", "system_tracks")

    def check_order(self, tracks: Path) -> None:
        """Check that tracks and reference are not exchanged.

        Raises
        ------
        InputError
            They are.
        """
        from multiradar_schemas.documents.contents import MEASUREMENTS, TRACKS, content

        first = content(tracks)
        for reference in (self.truth, self.adsb, self.smoothed, self.system_tracks):
            if reference is None or first not in MEASUREMENTS or content(reference) != TRACKS:
                continue
            msg = (
                f"tracks and reference are swapped: {tracks} is {first}, {reference} is "
                f"{TRACKS}; specify the tracks first, and the measurements as the reference"
            )
            raise InputError(msg)

    def _recorded(self) -> bool:
        from multiradar.toolbox.evaluation.recorded import is_recorded_truth

        return is_recorded_truth(self.truth)

    def read(self, tracks: Path, sensors: Path | None, settings: "EvaluationSettings") -> "Known":
        """Read the reference of tracks.

        Raises
        ------
        InputError
            It is missing or cannot be used.
        """
        from multiradar.toolbox.evaluation.inputs import read_recorded, read_truth
        from multiradar.toolbox.evaluation.tracked import read_regions

        regions = read_regions(tracks, None if settings.whole_reference else sensors)
        if self.truth is None:
            return self._read(tracks, sensors, settings, regions)
        if not self._recorded():
            return read_truth(self.truth, settings, regions)
        alone = self.adsb is self.smoothed is self.system_tracks is None
        known = None if alone else self._read(tracks, sensors, settings, regions)
        return read_recorded(self.truth, known, settings, regions)

    def _read(
        self,
        tracks: Path,
        sensors: Path | None,
        settings: "EvaluationSettings",
        regions: "Sequence[CoveredRegion]",
    ) -> "Known":
        from multiradar.toolbox.evaluation.inputs import (
            read_reports,
            read_smoothed,
            read_system_tracks,
        )

        if self.adsb is not None:
            return read_reports(self.adsb, settings, regions)
        if self.system_tracks is not None:
            return read_system_tracks(self.system_tracks, settings, regions, self.processor)
        assert self.smoothed is not None
        if sensors is None:
            msg = (
                f"missing `sensors`, which `smoothed` requires (there is no sensors.toml next to "
                f"the tracks in {tracks})"
            )
            raise ArgumentError(msg, "sensors", "smoothed")
        smoother = self.smoother or SMOOTHERS[0]
        return read_smoothed(self.smoothed, sensors, tracks, settings, smoother, regions=regions)

    def plots(self) -> Path | None:
        """Return the measurements of the tracks: those given, or those of the reference."""
        from multiradar.storage.recording import measurements_path

        if self.measurements is not None:
            return self.measurements
        candidates = (self.adsb, self.smoothed, self.truth, self.system_tracks)
        folders = [one for one in candidates if one is not None and one.suffix != ".json"]
        known = [one for one in folders if one.is_dir() or one in {self.adsb, self.smoothed}]
        return next((one for one in known if measurements_path(one).is_file()), None)


def compared(
    tracks: Path,
    chosen: References,
    settings: "EvaluationSettings",
    presets: Sequence[str],
) -> "tuple[Scorecard, Figures, list[str]]":
    """Compare tracks with a reference.

    Parameters
    ----------
    tracks : Path
        The folder that `track` made, or its `tracks.parquet`.
    chosen : References
        The reference.
    settings : EvaluationSettings
        How they are compared.
    presets : sequence of str
        Requirements to evaluate.

    Returns
    -------
    Scorecard, dict, list of str
        All measures, the figures, and what is wrong with the tracks or the reference.
    """
    from multiradar.evaluation.card.figures import figures_of
    from multiradar.evaluation.common_offset import common_offset, time_offset
    from multiradar.evaluation.overlap import BARELY_MIN, check_matched, rarely_matched
    from multiradar.evaluation.reference_checks import (
        clock_offset,
        height_unit,
        mostly_uncovered,
        poorly_matched,
        rejected_rows,
        shared_sensors,
        wide_gate,
    )
    from multiradar.evaluation.scorecard import evaluate as evaluate_tracks
    from multiradar.toolbox.evaluation.inputs import recorded_rows
    from multiradar.toolbox.evaluation.rounding import rounded_positions
    from multiradar.toolbox.evaluation.tracked import (
        read_biases,
        read_forecasts,
        read_tracks,
        sensors_file,
    )
    from multiradar.toolbox.inputs import read_sensors

    chosen.check_order(tracks)
    sensors = sensors_file(tracks, chosen.sensors)
    known = chosen.read(tracks, sensors, settings)
    counts = known.reference.counts
    _check_step(known, settings)
    early = rejected_rows(counts) + mostly_uncovered(counts)
    early += wide_gate(known.reference, settings) + rounded_positions(known.reference)
    for sentence in early:
        warn(sentence, DataWarning)
    evaluated = read_tracks(tracks, known, settings)
    listed = () if sensors is None else read_sensors(sensors).sensor
    rows = recorded_rows(chosen.plots(), may_be_empty=chosen.measurements is None)
    card = evaluate_tracks(
        evaluated,
        known.reference,
        settings,
        presets,
        plots=known.plots,
        biases=read_biases(tracks, known),
        sensors=listed,
        radar_plots=None if rows is None else rows.filter(kind="radar"),
        forecasts=read_forecasts(tracks),
    )
    late = time_offset(card.instants, settings.gate_m)
    check_matched(evaluated, known.reference, card.instants.track_of, settings.gate_m, late)
    findings = [*known.findings, *filter(None, [late])]
    sentences = height_unit(evaluated, card.errors)
    if late is None:
        poorly = poorly_matched(evaluated, known.reference, card.instants, settings)
        barely = rarely_matched(card.instants.track_of, settings.gate_m, BARELY_MIN)
        findings += [one for one in poorly if one in barely]
        sentences += [one for one in poorly if one not in barely]
        sentences += clock_offset(evaluated, card.errors)
    sentences += shared_sensors(evaluated, _reporters(known, listed))
    offset = common_offset(card.errors)
    findings += _of_other_recordings(evaluated, chosen, listed, rows)
    if offset is not None:
        (findings if offset.dominates else sentences).append(offset.sentence)
    for sentence in sentences:
        warn(sentence, DataWarning)
    return card, {"reference": _named(chosen, known), **figures_of(card)}, findings


# ADS-B converted alone may have the name of a radar or multilateration of the tracks.
def _reporters(known: "Known", sensors: "Sequence[Sensor]") -> list[str]:
    ids = {name: one.id for one in sensors for name in one.all_names()}
    named_alike = {one.id for one in sensors if one.kind != "adsb"}
    return sorted({ids.get(one, one) for one in known.reporters} - named_alike)


def _named(chosen: References, known: "Known") -> "Figures":
    from multiradar.evaluation.card.figures import row_figures

    what: Figures = {"kind": known.kind, "path": str(known.path), **known.claimed}
    what |= row_figures(known.reference.counts)
    if chosen.sensors is not None:
        what["sensors"] = str(chosen.sensors)
    if chosen.measurements is not None:
        what["measurements"] = str(chosen.measurements)
    return what


# Files that were given beside a reference, and are not those of the tracks.
def _of_other_recordings(
    tracks: "Tracks",
    chosen: References,
    sensors: "Sequence[Sensor]",
    rows: "pl.DataFrame | None",
) -> list[str]:
    import polars as pl

    from multiradar.evaluation.measures.update_times import with_ids
    from multiradar.evaluation.reference_checks import of_another_recording, of_other_sensors

    found: list[str] = []
    if chosen.sensors is not None:
        names: set[str] = set().union(*(one.all_names() for one in sensors))
        radars = [] if rows is None else rows.filter(kind="radar")["sensor_id"].unique().to_list()
        found += of_other_sensors(tracks, radars, names, chosen.sensors)
    if chosen.measurements is not None and rows is not None:
        found += of_another_recording(tracks, rows, sensors, chosen.measurements)
    elif chosen.smoothed is not None and rows is not None:
        # Measurements of other sensors alone are a reference, too.
        used = pl.DataFrame({"sensor_id": tracks.sensor_id[tracks.measured]})
        theirs, own = (
            set(with_ids(one, sensors)["sensor_id"].unique().to_list()) for one in (rows, used)
        )
        if theirs & own:
            found += of_another_recording(tracks, rows, sensors, chosen.smoothed)
    return found


def _check_step(known: "Known", settings: "EvaluationSettings") -> None:
    times_s = known.reference.time_s
    whole_s = float(times_s.max() - times_s.min()) if len(times_s) else settings.step_s
    if settings.step_s > max(whole_s, type(settings)().step_s):
        msg = (
            f"step {settings.step_s:g} s: longer than the reference, {whole_s:.0f} s, so that "
            "tracks and aircraft are compared at one instant at most; reduce the step"
        )
        raise InputError(msg)
