"""Runs the studies and puts their main table and plots into studies.md, and docs/images.

::

    python -m validation.documents.make_study_figures  # all studies with defaults
    python -m validation.documents.make_study_figures coupled-motion  # one of them

The plots of a study are those named in `PICTURES`, or else the first.
"""

import argparse
import sys
import textwrap
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from multiradar.report.content import Plot
from multiradar.report.markdown import markdown_table
from multiradar.report.plot_files import plot_svg
from multiradar.research.studies.catalogue import STUDIES
from multiradar.research.studies.document import command_of
from multiradar.research.studies.result import StudyOptions, StudyResult
from validation.documents.marked_parts import put

#: Characters of a line of the pages.
WIDTH = 120
DOCS = Path(__file__).parents[2] / "docs"
#: Names of the plots in studies.md, where it is not the first of the study.
PICTURES = {
    "bearing-only": ("position", "geometry"),
    "manoeuvre-plane": ("normal", "distance", "criterion"),
    "coupled-motion": ("figure-1", "figure-3"),
    "trajectory-bundle": (
        "service-flight", "service", "lateral-acceleration", "figure-2-1", "figure-2-2-flight",
        "figure-2-2", "figure-2-3", "figure-2-4",
    ),
}  # fmt: skip


def main() -> None:
    """Run the named studies and write their results."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("studies", nargs="*", help="names of studies; all where none is given")
    parser.add_argument("--runs", type=int, help="realisations; the study's own where not given")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder of studies.md")
    arguments = parser.parse_args()
    for name in arguments.studies or STUDIES:
        options = StudyOptions(runs=arguments.runs, seed=arguments.seed)
        result = STUDIES[name].run(options, partial(print_progress, name))
        write(result, arguments.docs)


def print_progress(name: str, done: int, total: int) -> None:
    """Print the progress of a study on standard error."""
    end = "\n" if done == total else ""
    print(f"\r{name}: {done} of {total}", end=end, file=sys.stderr, flush=True)


def write(result: StudyResult, docs: Path) -> None:
    """Write the plots of a result, and its part of studies.md."""
    pictures = []
    for number, plot in enumerate(chosen(result)):
        more = f"-{plot.name}" if number else ""
        file = f"images/study-{result.study}{more}.svg"
        (docs / file).write_text(plot_svg(result.plots, plot), encoding="utf-8")
        title = f"{plot.title} – {plot.group}" if plot.group else plot.title
        pictures.append(
            f"![{title}](../{file})\n" + (f"\n{plot.caption}\n" if plot.caption else "")
        )
    head = f"Made by `{command_of(result)}`.\n"
    parts = [head, f"**{result.tables[0].title}**\n", markdown_table(result.tables[0]), *pictures]
    paragraphs = "\n".join(parts).split("\n\n")
    put(docs / "validation" / "studies.md", result.study, "\n\n".join(map(filled, paragraphs)))


def filled(paragraph: str) -> str:
    """Return a paragraph in lines of the width of the pages; tables and pictures as they are."""
    if paragraph.lstrip().startswith(("|", "!")):
        return paragraph
    return textwrap.fill(paragraph, WIDTH, break_long_words=False, break_on_hyphens=False)


def chosen(result: StudyResult) -> Sequence[Plot]:
    """Return the plots that the document shows."""
    named = [plot for plot in result.plots if plot.name in PICTURES.get(result.study, ())]
    return named or result.plots[:1]


if __name__ == "__main__":
    main()
