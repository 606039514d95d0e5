"""The scorecard of tracks."""

from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from multiradar.errors import ArgumentError, ConfigurationError, FindingsError
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.toolbox.arguments import checked_options, typed
from multiradar.toolbox.conversion.convert import Conversion
from multiradar.toolbox.output import PathLike
from multiradar.toolbox.run import Run
from multiradar.toolbox.simulation import Simulation
from multiradar_schemas.documents.names import unknown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from multiradar.evaluation.card.figures import Figures
    from multiradar.evaluation.scorecard import Scorecard
    from multiradar.report.content import Document
    from multiradar.toolbox.frames import Frame

#: Output of a function, a path, or a table.
Source: TypeAlias = "Run | Conversion | Simulation | PathLike | Frame"


class Evaluation:
    """A scorecard.

    Parameters
    ----------
    tracks : str
        Name of the tracks.
    card : Scorecard
        All measures.
    figures : dict
        The figures.
    measurements : Path, optional
        The measurements of the tracks, if known.
    """

    def __init__(
        self,
        tracks: str,
        card: "Scorecard",
        figures: "Figures",
        measurements: Path | None = None,
    ) -> None:
        self._tracks, self._card, self._figures = tracks, card, figures
        self.measurements = measurements

    def __repr__(self) -> str:
        """Return the number of updates compared and their median error."""
        return f"Evaluation({self.document(whole=False).summary})"

    @property
    def figures(self) -> dict[str, Any]:
        """All figures, as ``multiradar evaluate --json`` prints them; units are in their names."""
        from multiradar_schemas.rounding import rounded

        figures: dict[str, Any] = rounded(self._figures)
        return figures

    @property
    def passed(self) -> dict[str, bool]:
        """Whether each evaluated requirement is met, by "preset: requirement"."""
        return {
            f"{one.preset}: {one.requirement.text}": one.outcome == "pass"
            for one in self._card.preset_results
        }

    def document(self, *, whole: bool) -> "Document":
        """Return the tables for a report; with `whole`, also the plots."""
        from multiradar.toolbox.evaluation.document import scorecard_document

        return scorecard_document(Path(self._tracks), self._card, self._figures, whole=whole)

    def page(self) -> str:
        """Return the scorecard with maps and plots as an HTML page."""
        from multiradar.report.page import report_page

        return report_page(self.document(whole=True))

    @typed
    def plot(self, *names: str) -> "Figure":
        """Draw tracks over the reference, and position errors.

        Parameters
        ----------
        *names : str
            Names of plots: `map`, `worst`, `errors-over-time`, `distribution`, `along-across`,
            `numbers`, `ospa`, `nees-position`, `nees-velocity`, and `bias-…`; by default `map`,
            `errors-over-time`, `distribution` and `along-across`.

        Returns
        -------
        Figure
            Of matplotlib; save it with `Figure.savefig`.

        Raises
        ------
        ArgumentError
            There is no plot of this name.
        """
        from multiradar.evaluation.card.plots import card_plots
        from multiradar.toolbox.pages.pictures import picture

        plots = card_plots(self._card)
        usual = ("map", "errors-over-time", "distribution", "along-across")
        drawn = {plot.name for plot in plots}
        return picture(plots, names or tuple(name for name in usual if name in drawn))


@typed
def evaluate(
    tracks: "Source",
    *,
    truth: "Source | None" = None,
    adsb: "Source | None" = None,
    smoothed: "Source | None" = None,
    system_tracks: "Source | None" = None,
    processor: str | None = None,
    sensors: PathLike | None = None,
    measurements: "Source | None" = None,
    smoother: str | None = None,
    presets: Iterable[str] | None = None,
    **settings: float | bool | None,
) -> Evaluation:
    """Evaluate tracks against a reference: errors, gaps, swaps, OSPA, SIAP, NEES, requirements.

    Parameters
    ----------
    tracks : Run, path or table
        What `track` returned, its folder, or rows of `tracks.parquet`.
    truth : Simulation, path or table, optional
        Reference: the truth of a simulation; or the `truth.json` of a dump.
    adsb : Conversion, Simulation, path or table, optional
        Reference: the ADS-B reports among these measurements.
    smoothed : Conversion, Simulation, path or table, optional
        Reference: these measurements, corrected by the biases of the tracks and smoothed.
    system_tracks : Conversion, path or table, optional
        Reference: system tracks of another processor; `processor` is its SAC-SIC.
    sensors : path, optional
        Sensors of the tracks; by default those next to them.
    measurements : Conversion, Simulation, path or table, optional
        Plots of the tracks, for differences by radar; by default those of the reference.
    smoother : str, optional
        Motion model of `smoothed`: constant-velocity (the default) or imm.
    presets : iterable of str, optional
        Requirements: ed142-enroute, ed142-tma, esassp-3nm, esassp-5nm; all by default.
    **settings
        Fields of `multiradar.evaluation.settings.EvaluationSettings`, such as ``gate_m=1000``.

    Returns
    -------
    Evaluation
        `.figures`, `.passed`, `.plot()`, `.page()`.

    Raises
    ------
    ArgumentError
        There is no reference, or there are several, or an argument is unknown.
    InputError
        A table cannot be used.
    FindingsError
        No update was compared, all tracks have the same displacement, or the measurements to be
        smoothed are wrong; the scorecard is in `.output`.

    Notes
    -----
    docs/howto/scorecard.md defines every measure and names its source.
    """
    from multiradar.evaluation.presets import PRESETS
    from multiradar.toolbox.evaluation.comparison import References, compared

    chosen = evaluation_settings(settings)
    requirements = list(dict.fromkeys(PRESETS if presets is None else presets))
    for name in requirements:
        if name not in PRESETS:
            raise ArgumentError(f"`presets`: {unknown('preset', name, PRESETS)}", "presets")
    with ExitStack() as held:
        names: dict[Path, str] = {}

        def file(given: "Source | None", name: str) -> Path | None:
            return None if given is None else _file(given, name, held, names)

        references = References(
            truth=file(truth, "truth"),
            adsb=file(adsb, "adsb"),
            smoothed=file(smoothed, "smoothed"),
            system_tracks=file(system_tracks, "system_tracks"),
            processor=processor,
            sensors=None if sensors is None else Path(sensors),
            measurements=file(measurements, "measurements"),
            smoother=smoother,
        )
        references.check(density=settings.get("density"))
        path = _file(tracks, "tracks", held, names)
        card, figures, findings = compared(path, references, chosen, requirements)
        reference: dict[str, Any] = figures["reference"]  # type: ignore[assignment]  # a mapping
        for name in ("path", "measurements"):
            if name in reference:
                reference[name] = names.get(Path(reference[name]), reference[name])
        done = Evaluation(names[path], card, figures, references.plots())
    if not figures["compared"]["updates_compared"]:  # type: ignore[index,call-overload]  # a mapping
        after = f" after the first {chosen.settling_s:g} s of each track (settling)"
        msg = (
            f"no update was compared with the reference{after if chosen.settling_s else ''}; "
            "check that tracks and reference overlap in time"
        )
        findings = [msg, *findings]
    if findings:
        raise FindingsError(findings, done)
    return done


def evaluation_settings(given: dict[str, Any]) -> EvaluationSettings:
    """Return settings by name; None means the default.

    Raises
    ------
    ArgumentError
        A name is unknown, or a value out of range.
    """
    known = [one.name for one in fields(EvaluationSettings)]
    for name in given:
        if name not in known:
            raise ArgumentError(unknown("argument", name, known), name)
    chosen = {name: value for name, value in given.items() if value is not None}
    chosen = checked_options(chosen, EvaluationSettings)
    try:
        return EvaluationSettings(**chosen)
    except ConfigurationError as error:
        name, _, reason = str(error).partition(": ")
        raise ArgumentError(f"`{name}`: {reason}", name) from error


def _file(given: "Source", name: str, held: ExitStack, names: dict[Path, str]) -> Path:
    from multiradar.toolbox.frames import as_file

    own = isinstance(given, Run | Conversion | Simulation)
    path, shown = held.enter_context(as_file(given.folder if own else given, name))  # type: ignore[union-attr]  # as tested
    names[path] = shown
    return path
