"""Compares the outputs shown in the documents with program output.

::

    python -m validation.documents.check_documents  # everything; hours
    # what `make test` compares, under a minute
    python -m validation.documents.check_documents --quick
    # and put into the page what differs
    python -m validation.documents.check_documents --write guide/track.md
    # what would be compared, and what is slow
    python -m validation.documents.check_documents --list

A block or table is compared when a comment precedes it::

    <!-- output of: multiradar track converted --sensors sensors.toml --out tracks; mask seconds -->

Commands of a page run in order in a temporary folder that contains `examples`, `docs` and
`validation` of the repository. Options of a comment, after semicolons:

- ``slow 40 s``: duration on two cores; `make test` skips it,
- ``mask NAME …``: parts that may differ, of `MASKS`,
- ``table N``: it is the N-th table of the output, if not the first of the same header,
- ``rows``: the output contains only the rows,
- ``lines PATTERN``: only matching lines of the output are shown,
- ``json``: compared with six decimals, ignoring white space.

``<!-- output of: python -->`` shows what the last block of Python above it prints; all such blocks
of a page are one program, in their order.

``<!-- before: COMMAND -->`` runs a command that the page does not show. `multiradar serve` listens
on free ports and runs until the page ends; `curl` and `multiradar replay` use it.

Parts between ``<!-- NAME: made by SCRIPT.py; slow 5 min -->`` and ``<!-- end of NAME -->`` are made
by that script of `validation`, which is run on a copy of the documents (``--docs``).
"""

import argparse
import difflib
import json
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from multiradar.clock import SystemClock
from validation.documents.workspace import TIMEOUT_S, Runner, Workspace, environment, in_process

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("README.md", *sorted(str(one.relative_to(ROOT)) for one in ROOT.glob("docs/**/*.md")))
#: Patterns of text that differs between runs or processors, by name.
MASKS = {
    "digest": r"(?<=output_sha256 )[0-9a-f]{64}",
    "ports": r"(?<=127\.0\.0\.1:)\d+",
    "seconds": r"\d+\.\d s\b",
    "stages": r"^\d+\.\d s: .*$",
    "folder": r"(?<=, )\/\S+(?=\))",
    "progress": r"(?:^\d\d:\d\d:\d\d .*\n)+",
}
#: Width of lines of JSON.
JSON_COLUMNS = 118
_DECIMALS = 6
#: Between the outputs of two blocks of Python.
BLOCK = "<end of block>"
_COMMENT = re.compile(r"^<!-- (output of|before): (.+?) -->$")
_MADE = re.compile(r"^<!-- ([\w-]+): made by ([\w/]+\.py[^;>]*?)(?:; slow ([^>]+?))? -->$")


@dataclass(frozen=True)
class Step:
    """A command of a page, and the output shown there.

    Attributes
    ----------
    page : str
        Path of the page from the root of the repository.
    line : int
        Number of the line of the comment, from 1.
    command : str
        The command line; of a part that a script makes, the script.
    options : dict
        Options of the comment, by their first word.
    begin, end : int
        Lines that are compared, as indices; none where the output is not shown.
    """

    page: str
    line: int
    command: str
    options: dict[str, str]
    begin: int = 0
    end: int = 0

    @property
    def slow(self) -> bool:
        """Whether it runs only in `make docs-check`."""
        return "slow" in self.options

    @property
    def where(self) -> str:
        """Page and line."""
        return f"{self.page}:{self.line}"

    @property
    def name(self) -> str:
        """The command in one line; of a program, its first."""
        return self.command.partition("\n")[0]


def steps_of(page: str, text: str) -> list[Step]:
    """Return the steps of a page in their order.

    Raises
    ------
    ValueError
        A comment precedes nothing that can be compared, or has an unknown option.
    """
    lines = text.splitlines()
    steps = []
    for number, line in enumerate(lines):
        if made := _MADE.match(line):
            name, script, duration = made.groups()
            end = lines.index(f"<!-- end of {name} -->", number)
            options = {"made": name, "slow": duration or ""}
            steps.append(Step(page, number + 1, script, options, number + 1, end))
        elif comment := _COMMENT.match(line):
            command, *rest = comment[2].split("; ")
            options = dict((*one.split(" ", 1), "")[:2] for one in rest)
            if unknown := set(options) - {"slow", "mask", "table", "rows", "lines", "json"}:
                raise ValueError(f"{page}:{number + 1}: unknown: {', '.join(sorted(unknown))}")
            if command == "python":
                command, options["block"] = _program(lines, number)
            shown = _block(lines, number + 1) if comment[1] == "output of" else (0, 0)
            if shown is None:
                raise ValueError(f"{page}:{number + 1}: expected a block or a table below it")
            steps.append(Step(page, number + 1, command, options, *shown))
    return steps


# The program of a page, and the number of the block above a line.
def _program(lines: Sequence[str], line: int) -> tuple[str, str]:
    starts = [number for number, one in enumerate(lines) if one == "```python"]
    blocks = ["\n".join(lines[at + 1 : lines.index("```", at)]) for at in starts]
    code = f"\nprint({BLOCK!r})\n".join(blocks)
    return f"python -c {shlex.quote(code)}", str(sum(at < line for at in starts) - 1)


# The lines of the block or table that starts at a line, or after an empty one.
def _block(lines: Sequence[str], start: int) -> tuple[int, int] | None:
    while start < len(lines) and not lines[start]:
        start += 1
    if start < len(lines) and lines[start].startswith("```"):
        return start + 1, lines.index("```", start + 1)
    end = start
    while end < len(lines) and lines[end].startswith("|"):
        end += 1
    return (start, end) if end > start else None


def difference(step: Step, shown: Sequence[str], found: Sequence[str]) -> str:
    """Return the difference between page and output; empty without one."""
    left, right = (_masked(step, lines) for lines in (shown, found))
    if "json" in step.options:
        left, right = ([json.dumps(_shortened(json.loads(" ".join(one))))] for one in (left, right))
    if left == right:
        return ""
    return "\n".join(difflib.unified_diff(left, right, "the page", "the program", lineterm=""))


def _masked(step: Step, lines: Sequence[str]) -> list[str]:
    text = "\n".join(line.rstrip() for line in lines)
    for name in step.options.get("mask", "").split():
        text = re.sub(MASKS[name], "…", text, flags=re.MULTILINE)
    return text.splitlines()


def chosen(step: Step, shown: Sequence[str], output: str) -> list[str]:
    """Return the part of an output shown by a page.

    Parameters
    ----------
    step : Step
        The command.
    shown : sequence of str
        The lines of the page now.
    output : str
        The output of the command.

    Raises
    ------
    ValueError
        The output has no such table.
    """
    if "block" in step.options:
        output = output.split(f"{BLOCK}\n")[int(step.options["block"])]
    lines = [line.rstrip() for line in output.rstrip("\n").splitlines()]
    if "json" in step.options:
        return _filled(json.dumps(_shortened(json.loads(output)), ensure_ascii=False))
    if "lines" in step.options:
        lines = [line for line in lines if re.search(step.options["lines"], line)]
    if not shown or not shown[0].startswith("|"):
        return lines
    if "rows" in step.options:
        return [*shown[:2], *(line for line in lines if line.startswith("|"))]
    tables = list(_tables(lines))
    number = int(step.options.get("table", 0))
    if number:
        found = tables[number - 1 : number]
    else:
        found = [table for table in tables if table[0] == shown[0]]
    if not found:
        raise ValueError(f"{step.where}: no such table in the output of {step.command}")
    return found[0]


# The last digits of a number are those of one machine.
def _shortened(value: Any) -> Any:
    if isinstance(value, list):
        return [_shortened(one) for one in value]
    if isinstance(value, dict):
        return {name: _shortened(one) for name, one in value.items()}
    return round(value, _DECIMALS) + 0.0 if isinstance(value, float) else value


# JSON in lines: each begins with a member of an object, or with an object.
def _filled(text: str) -> list[str]:
    lines = [""]
    for part in re.split(r"(?<=,) (?=[\"{])", text):
        if (lines[-1] and len(lines[-1]) + len(part) >= JSON_COLUMNS) or part.startswith("{"):
            lines.append("")
        lines[-1] = f"{lines[-1]} {part}".strip()
    return [line for line in lines if line]


def _tables(lines: Sequence[str]) -> Iterator[list[str]]:
    start = 0
    while start < len(lines):
        end = start
        while end < len(lines) and lines[end].startswith("|"):
            end += 1
        if end > start:
            yield list(lines[start:end])
        start = end + 1


@dataclass(frozen=True)
class Copy:
    """The documents generated by a script, and the pictures that it changed."""

    docs: Path
    pictures: tuple[str, ...]


def copy_made(script: str) -> Copy:
    """Return a copy of the documents after running one of their scripts.

    Parameters
    ----------
    script : str
        Its name and options.
    """
    copy = Path(tempfile.mkdtemp(prefix="multiradar-documents-")) / "docs"
    shutil.copytree(ROOT / "docs", copy)
    name, *options = shlex.split(script)
    module = ".".join(("validation", *Path(name).with_suffix("").parts))
    line = [sys.executable, "-m", module, *options, "--docs", str(copy)]
    subprocess.run(
        line,
        cwd=ROOT,
        env=environment(),
        stdout=subprocess.DEVNULL,
        timeout=TIMEOUT_S,
        check=True,
    )
    now = sorted((copy / "images").iterdir())
    changed = (one for one in now if _octets(ROOT / "docs" / "images" / one.name) != _octets(one))
    return Copy(copy, tuple(one.name for one in changed))


def _octets(path: Path) -> bytes:
    return path.read_bytes() if path.exists() else b""


def compared(
    page: str, wanted: Sequence[Step], *, write: bool, run: Runner = in_process
) -> Iterator[tuple[Step, str, float]]:
    """Run the steps of a page and compare; yield each that is shown with its difference and time.

    Parameters
    ----------
    page : str
        The page.
    wanted : sequence of Step
        The steps to run, in order.
    write : bool
        Whether differences are corrected in the page.
    run : Runner
        Runs the programs.
    """
    clock = SystemClock()
    text_before = (ROOT / page).read_text(encoding="utf-8")
    lines = text_before.splitlines()
    found: list[tuple[Step, list[str]]] = []
    made: dict[str, Copy] = {}
    with Workspace(ROOT, run) as workspace:
        for step in wanted:
            started_s = clock.monotonic_s()
            shown = lines[step.begin : step.end]
            if "made" in step.options:
                right = _part(step, made)
            else:
                output = workspace.output(step.command)
                if step.end == 0:
                    continue
                right = chosen(step, shown, output)
            text = difference(step, shown, right)
            if text:
                found.append((step, right))
            yield step, text, clock.monotonic_s() - started_s
    if write and (found or any(copy.pictures for copy in made.values())):
        _put(page, text_before, found, made)
    for copy in made.values():
        shutil.rmtree(copy.docs.parent)


def _part(step: Step, made: dict[str, Copy]) -> list[str]:
    if step.command not in made:
        made[step.command] = copy_made(step.command)
    page = made[step.command].docs / Path(step.page).relative_to("docs")
    text = page.read_text(encoding="utf-8")
    part = next(
        one for one in steps_of(step.page, text) if one.options.get("made") == step.options["made"]
    )
    return text.splitlines()[part.begin : part.end]


# The page is read again: hours may have passed. Pictures that a script makes go with its tables.
def _put(
    page: str, before: str, found: Sequence[tuple[Step, list[str]]], made: dict[str, Copy]
) -> None:
    places = {step.line: place for place, step in _placed(steps_of(page, before))}
    right = {places[step.line]: lines for step, lines in found}
    text = (ROOT / page).read_text(encoding="utf-8")
    lines = text.splitlines()
    for place, step in reversed(_placed(steps_of(page, text))):
        if place in right:
            lines[step.begin : step.end] = right[place]
    (ROOT / page).write_text("\n".join(lines) + "\n", encoding="utf-8")
    for copy in made.values():
        for name in copy.pictures:
            shutil.copy(copy.docs / "images" / name, ROOT / "docs" / "images" / name)


# Steps with their identity: the command, its comment, and the number of earlier occurrences.
def _placed(steps: Sequence[Step]) -> list[tuple[tuple[str, int], Step]]:
    seen: Counter[str] = Counter()
    placed = []
    for step in steps:
        name = f"{step.command}; {step.options}"
        placed.append(((name, seen[name]), step))
        seen[name] += 1
    return placed


def main() -> int:
    """Compare the selected steps; return 1 when something differs."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("only", nargs="*", help="parts of paths or commands; all where none is")
    parser.add_argument("--quick", action="store_true", help="leave out what is slow")
    parser.add_argument("--write", action="store_true", help="put what differs into the pages")
    parser.add_argument("--list", action="store_true", help="name the commands and leave")
    arguments = parser.parse_args()
    differ = 0
    for page in PAGES:
        steps = steps_of(page, (ROOT / page).read_text(encoding="utf-8"))
        wanted = selected(steps, arguments.only, quick=arguments.quick)
        if arguments.list:
            for step in wanted:
                print(f"{step.where}: {step.name} {step.options.get('slow', '')}".rstrip())
            continue
        for step, text, time_s in compared(page, wanted, write=arguments.write):
            result = "differs" if text else "same"
            print(f"{result:8}{time_s:7.1f} s  {step.where}  {step.name}", flush=True)
            if text:
                differ += 1
                print(textwrap.indent(text, "    "), flush=True)
    return int(differ > 0 and not arguments.write)


def selected(steps: Sequence[Step], only: Sequence[str], *, quick: bool) -> list[Step]:
    """Return the steps to run: the selected ones, and those that they depend on.

    Parameters
    ----------
    steps : sequence of Step
        Of a page.
    only : sequence of str
        Parts of a path or command; empty for all.
    quick : bool
        Whether slow steps are skipped.
    """
    fast = [step for step in steps if not (quick and step.slow)]
    asked = [
        step
        for step in fast
        if step.end and (not only or any(one in step.where + step.command for one in only))
    ]
    if not asked:
        return []
    # Earlier steps may create inputs of these, unless they are independent parts.
    last = fast.index(asked[-1])
    return [
        step
        for step in fast[: last + 1]
        if step in asked or not ("made" in step.options or step.command.startswith("python"))
    ]


if __name__ == "__main__":
    sys.exit(main())
