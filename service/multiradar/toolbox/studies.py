"""Studies: the tables and figures of the source papers."""

from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from multiradar.errors import ArgumentError
from multiradar.research.studies.catalogue import STUDIES, StudyEntry
from multiradar.toolbox.arguments import typed
from multiradar.toolbox.compiling import compile_kernels
from multiradar.toolbox.messages.progress import counting_bar
from multiradar.toolbox.output import PathLike
from multiradar_schemas.documents.names import unknown

if TYPE_CHECKING:
    from multiradar.research.studies.result import StudyOptions, StudyResult


@typed
def study(
    name: str,
    *,
    runs: int | None = None,
    seed: int = 1,
    filters: Iterable[str] | None = None,
    duration_s: float | None = None,
    out: PathLike | None = None,
    figures: PathLike | None = None,
) -> "StudyResult":
    """Reproduce the tables and figures of a source paper.

    Parameters
    ----------
    name : str
        A study, as ``multiradar study --help`` lists them.
    runs : int, optional
        Number of Monte Carlo runs; by default that of the study.
    seed : int
        Random seed; the same seed gives the same results.
    filters : iterable of str, optional
        Filters to compare; by default all filters of the study.
    duration_s : float, optional
        Duration of its scenario, s; by default that of the study.
    out : path, optional
        Also write an HTML report.
    figures : path, optional
        Also write each figure as SVG and PDF into this new folder, in the order of the report.

    Returns
    -------
    StudyResult
        `.rows` for programs, `.tables`, `.plots` and `.notes` for readers.

    Raises
    ------
    ArgumentError
        There is no such study, it does not support an argument, or the duration is out of its
        bounds.
    UnknownFilterError
        The study does not compare this filter.
    OutputExistsError
        `out` or `figures` exists.

    Notes
    -----
    docs/validation/studies.md names the paper and the figures of each.
    """
    from multiradar.research.studies.result import StudyOptions

    if name not in STUDIES:
        raise ArgumentError(unknown("study", name, STUDIES))
    entry = STUDIES[name]
    chosen = None if filters is None else tuple(dict.fromkeys(filters))
    given = {"runs": runs, "filters": chosen, "duration_s": duration_s}
    for argument, value in given.items():
        if value is not None and argument not in entry.supported_options:
            raise ArgumentError(f"`{argument}`: not supported by the study {name}", argument)
    if seed < 0 or (runs is not None and runs < 1):
        raise ArgumentError(
            "expected `runs` of at least 1 and `seed` of at least 0", "runs", "seed"
        )
    options = StudyOptions(runs, seed, chosen, duration_s)
    paths = (None if path is None else Path(path) for path in (out, figures))
    return run_study(entry, options, *paths)


def run_study(
    entry: StudyEntry, options: "StudyOptions", out: Path | None, figures: Path | None = None
) -> "StudyResult":
    """Run a study, with a progress bar on a terminal, and write its report.

    Parameters
    ----------
    entry : StudyEntry
        The study.
    options : StudyOptions
        Its options.
    out : Path, optional
        Report to write.
    figures : Path, optional
        Folder to make, for each figure as SVG and PDF.

    Returns
    -------
    StudyResult
        The result.

    Raises
    ------
    UnknownFilterError
        A filter that the study does not compare.
    ArgumentError
        A duration outside the bounds of the study.
    OutputExistsError
        `out` or `figures` exists.
    """
    from multiradar.storage.output_file import new_file
    from multiradar.storage.output_folder import new_folder
    from multiradar_compiled.kernel_list import kernels_by_purpose

    purpose = f"study {entry.name}"
    if purpose in kernels_by_purpose():
        compile_kernels([purpose])
    completed = entry.complete(options)
    with ExitStack() as held:
        # Outputs are opened before the run: a wrong name must not cost minutes of computation.
        partial = None if out is None else held.enter_context(new_file(out))
        folder = None if figures is None else held.enter_context(new_folder(figures))
        with counting_bar(entry.name) as progress:
            result = entry.run(completed, progress)
        if partial is not None:
            from multiradar.report.page import report_page
            from multiradar.research.studies.document import document_of

            partial.write_text(report_page(document_of(result)), encoding="utf-8")
        if folder is not None:
            from multiradar.report.plot_files import write_plots

            write_plots(result.plots, folder)
    return result
