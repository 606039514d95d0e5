"""The result of a study as a report, with the command to reproduce it."""

from multiradar.report.content import Document
from multiradar.research.studies.catalogue import FLAGS
from multiradar.research.studies.result import StudyResult


def command_of(result: StudyResult) -> str:
    """Return the command line that reproduces a result.

    Parameters
    ----------
    result : StudyResult
        With the options of the run.

    Returns
    -------
    str
        One line for a shell.
    """
    parts = ["multiradar", "study", result.study]
    for name, flag in FLAGS.items():
        value = result.options.get(name)
        if isinstance(value, list | tuple):
            parts += [flag, ",".join(map(str, value))]
        elif isinstance(value, float):
            parts += [flag, f"{value:g}"]
        elif value is not None:
            parts += [flag, str(value)]
    return " ".join([*parts, "--seed", str(result.seed)])


def document_of(result: StudyResult) -> Document:
    """Return the report of a study.

    Returns
    -------
    Document
        Its tables, plots and notes, with the command to reproduce them.
    """
    return Document(
        title=result.title,
        summary=result.summary,
        command=command_of(result),
        tables=result.tables,
        plots=result.plots,
        notes=result.notes,
    )
