"""Documents match program output; slow commands are compared by `make docs-check`."""

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from multiradar.cli.main import main
from support.paths import ROOT
from support.processes.commands import run_forked
from validation.documents import check_documents as documents


def _quick(page: str) -> Any:
    steps = documents.steps_of(page, (ROOT / page).read_text(encoding="utf-8"))
    return documents.selected(steps, [], quick=True)


def _forked(
    line: Sequence[str], folder: Path, environment: Mapping[str, str]
) -> "subprocess.CompletedProcess[str]":
    """Run a program in a process that has loaded what commands need."""
    return run_forked(_program, [*line], str(folder), dict(environment))


def _program(line: list[str], folder: str, environment: dict[str, str]) -> None:
    # Relative paths would lead elsewhere.
    sys.path[:] = map(os.path.abspath, sys.path)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    if line[0] == "multiradar":
        sys.argv = line
        main()
    else:
        assert line[:2] == ["python", "-c"]
        exec(line[2], {"__name__": "__main__"})


@pytest.mark.parametrize("page", [page for page in documents.PAGES if _quick(page)])
def test_pages_match_the_output_of_quick_commands(page: str) -> None:
    found = documents.compared(page, _quick(page), write=False, run=_forked)
    differ = [f"{step.where}: {step.command}\n{text}" for step, text, _ in found if text]
    assert differ == [], "run python -m validation.documents.check_documents --quick --write"


def test_quick_start_commands_are_checked_quickly() -> None:
    commands = [step.command for step in _quick("docs/guide/track.md")]
    assert any(command.startswith("multiradar convert vid") for command in commands)
    assert any(command.startswith("multiradar track") for command in commands)


def test_what_is_slow_says_how_long_it_takes() -> None:
    for page in documents.PAGES:
        for step in documents.steps_of(page, (ROOT / page).read_text(encoding="utf-8")):
            assert not step.slow or step.options["slow"], step.where


_PAGE = """\
# Page

<!-- before: multiradar simulate crossing --out scene -->
```sh
multiradar simulate --list
```
<!-- output of: multiradar simulate --list; mask seconds; slow 5 s -->
```
one   in 1.5 s
```
<!-- output of: python docs/check_x.py; table 2 -->

| a | b |
|---|---|
| 1 | 2 |

<!-- part: made by subject/make_y.py part; slow 2 min -->

text

<!-- end of part -->
"""


def test_a_page_is_read_in_its_order() -> None:
    before, block, table, made = documents.steps_of("docs/p.md", _PAGE)
    assert (before.command, before.end) == ("multiradar simulate crossing --out scene", 0)
    assert block.options == {"mask": "seconds", "slow": "5 s"}
    lines = _PAGE.splitlines()
    assert lines[block.begin : block.end] == ["one   in 1.5 s"]
    assert block.where == "docs/p.md:7"
    assert lines[table.begin : table.end] == ["| a | b |", "|---|---|", "| 1 | 2 |"]
    assert (table.options, table.slow) == ({"table": "2"}, False)
    assert (made.command, made.options) == (
        "subject/make_y.py part",
        {"made": "part", "slow": "2 min"},
    )
    assert lines[made.begin : made.end] == ["", "text", ""]


@pytest.mark.parametrize(
    "page", ["<!-- output of: x -->\n\ntext\n", "<!-- output of: x; fast -->\n```\n```\n"]
)
def test_a_comment_that_means_nothing_is_an_error(page: str) -> None:
    with pytest.raises(ValueError, match=r"docs/p\.md:1"):
        documents.steps_of("docs/p.md", page)


def test_quick_leaves_out_what_is_slow_and_keeps_what_the_others_need() -> None:
    steps = documents.steps_of("docs/p.md", _PAGE)
    quick = documents.selected(steps, [], quick=True)
    assert [step.command for step in quick] == [steps[0].command, steps[2].command]
    named = documents.selected(steps, ["simulate --list"], quick=False)
    assert [step.command for step in named] == [steps[0].command, steps[1].command]
    assert documents.selected(steps, ["nothing of it"], quick=False) == []


def _step(*options: str, page: str = "```\n```") -> Any:
    comment = "; ".join(["multiradar x", *options])
    return documents.steps_of("docs/p.md", f"<!-- output of: {comment} -->\n{page}\n")[0]


@pytest.mark.parametrize(
    ("mask", "shown", "output"),
    [
        ("seconds", "done in 1.5 s", "done in 22.0 s"),
        ("ports", "http://127.0.0.1:8321", "http://127.0.0.1:43139"),
        ("stages", "1.5 s: tracking 1.4 s", "39.7 s: starting 3.0 s, compiling 26.8 s"),
        ("progress", "head\n08:00:01  1\nend", "head\n08:00:02  2\n08:00:04  3\nend"),
    ],
)
def test_what_is_masked_may_differ_and_nothing_else(mask: str, shown: str, output: str) -> None:
    masked, plain = _step(f"mask {mask}"), _step()
    assert documents.difference(masked, shown.splitlines(), output.splitlines()) == ""
    assert documents.difference(plain, shown.splitlines(), output.splitlines()) != ""
    assert documents.difference(masked, ["x", *shown.splitlines()], output.splitlines()) != ""


def test_white_space_behind_lines_and_in_json_does_not_count() -> None:
    assert documents.difference(_step(), ["a", "b  "], ["a   ", "b"]) == ""
    assert documents.difference(_step("json"), ['{"a":', '1, "b": 2}'], ['{"a": 1, "b": 2}']) == ""
    assert documents.difference(_step("json"), ['{"a": 1}'], ['{"a": 2}']) != ""
    assert documents.difference(_step("json"), ["[1.5, 0.0]"], ["[1.5000000001, -1e-13]"]) == ""
    assert documents.difference(_step("json"), ["[1.5]"], ["[1.50001]"]) != ""


_OUTPUT = "title\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\n| a | b |\n|---|---|\n| 3 | 4 |\n\n| c |\n"


@pytest.mark.parametrize(
    ("options", "shown", "found"),
    [
        ((), ["| a | b |"], ["| a | b |", "|---|---|", "| 1 | 2 |"]),
        ((), ["| c |", "|---|"], ["| c |"]),
        (("table 2",), ["| x |"], ["| a | b |", "|---|---|", "| 3 | 4 |"]),
    ],
)
def test_a_table_is_found_by_its_header_or_its_number(
    options: tuple[str, ...], shown: list[str], found: list[str]
) -> None:
    assert documents.chosen(_step(*options), shown, _OUTPUT) == found


def test_rows_alone_keep_the_header_of_the_page() -> None:
    shown = ["| head |", "|---|", "| old |"]
    assert documents.chosen(_step("rows"), shown, "| 1 |\nnote\n| 2 |\n") == [
        "| head |", "|---|", "| 1 |", "| 2 |",
    ]  # fmt: skip


def test_a_table_missing_in_the_output_is_an_error() -> None:
    with pytest.raises(ValueError, match="no such table"):
        documents.chosen(_step(), ["| other |"], _OUTPUT)


def test_json_is_broken_into_lines_that_read_the_same() -> None:
    text = '{"rows": [' + ", ".join(['{"name": "value of some length"}'] * 9) + "]}"
    lines = documents.chosen(_step("json"), [], text)
    assert len(lines) > 2
    assert all(len(line) <= documents.JSON_COLUMNS for line in lines)
    assert documents.difference(_step("json"), lines, [text]) == ""


@pytest.fixture
def moved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "docs" / "images").mkdir(parents=True)
    for name in ("examples", "deploy", "validation"):
        (tmp_path / name).mkdir()
    monkeypatch.setattr(documents, "ROOT", tmp_path)
    return tmp_path


def test_what_differs_is_put_into_the_page(moved: Path) -> None:
    page = moved / "docs" / "p.md"
    command = "python -c \"print('right')\""
    text = f"a\n<!-- output of: {command} -->\n```\nwrong\nlines\n```\nb\n"
    page.write_text(text, encoding="utf-8")
    steps = documents.steps_of("docs/p.md", text)
    [(_, difference, _)] = documents.compared("docs/p.md", steps, write=False)
    assert "-wrong" in difference
    assert page.read_text(encoding="utf-8") == text
    list(documents.compared("docs/p.md", steps, write=True))
    right = page.read_text(encoding="utf-8")
    assert right == f"a\n<!-- output of: {command} -->\n```\nright\n```\nb\n"
    again = documents.compared("docs/p.md", documents.steps_of("docs/p.md", right), write=False)
    assert [text for _, text, _ in again] == [""]


def test_a_page_that_changed_meanwhile_keeps_its_changes(moved: Path) -> None:
    page = moved / "docs" / "p.md"
    # The same command twice, as for a repeated replay, with other text between.
    shown = "<!-- output of: python count.py -->\n```\n{}\n```\n"
    text = f"a\n{shown.format('1')}b\n{shown.format('x')}c\n"
    page.write_text(text, encoding="utf-8")
    steps = documents.steps_of("docs/p.md", text)
    found = [(steps[1], ["2"])]
    page.write_text(text.replace("a\n", "a new line\nand another\n", 1), encoding="utf-8")
    documents._put("docs/p.md", text, found, {})
    right = f"a new line\nand another\n{shown.format('1')}b\n{shown.format('2')}c\n"
    assert page.read_text(encoding="utf-8") == right


def test_lines_that_hold_a_pattern_are_shown_alone() -> None:
    assert documents.chosen(_step("lines RMS|b"), [], "a\nb RMS\nc\nRMS\n") == ["b RMS", "RMS"]


def test_a_part_and_its_pictures_are_made_by_their_script(moved: Path) -> None:
    script = (
        "import sys, pathlib\n"
        "docs = pathlib.Path(sys.argv[-1])\n"
        "page = docs / 'p.md'\n"
        "page.write_text(page.read_text().replace('old', sys.argv[1]))\n"
        "(docs / 'images' / 'one.svg').write_text('new picture')\n"
    )
    (moved / "validation" / "__init__.py").touch()
    (moved / "validation" / "make_p.py").write_text(script, encoding="utf-8")
    (moved / "docs" / "images" / "one.svg").write_text("old picture", encoding="utf-8")
    page = moved / "docs" / "p.md"
    text = "<!-- n: made by make_p.py new; slow 1 s -->\nold\n<!-- end of n -->\nold\n"
    page.write_text(text, encoding="utf-8")
    steps = documents.steps_of("docs/p.md", text)
    [(_, difference, _)] = documents.compared("docs/p.md", steps, write=True)
    assert "+new" in difference
    assert page.read_text(encoding="utf-8") == text.replace("\nold\n<!--", "\nnew\n<!--")
    assert (moved / "docs" / "images" / "one.svg").read_text() == "new picture"


def test_a_failed_command_is_reported_with_its_output(moved: Path) -> None:
    text = "<!-- output of: python -c \"raise SystemExit('no luck')\" -->\n```\n```\n"
    (moved / "docs" / "p.md").write_text(text, encoding="utf-8")
    with pytest.raises(RuntimeError, match="no luck"):
        list(documents.compared("docs/p.md", documents.steps_of("docs/p.md", text), write=False))
