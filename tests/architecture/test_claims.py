"""Every test claimed by docs/validation/studies.md exists."""

import ast
import re

from support.paths import ROOT

NAMED = re.compile(r"`([\w/]+\.py)` `(test_\w+)`")


def test_every_test_of_the_table_of_claims_exists() -> None:
    page = (ROOT / "docs" / "validation" / "studies.md").read_text(encoding="utf-8")
    table = page[page.index("## Claims of the papers and their verification") :]
    named = NAMED.findall(table)
    assert len(named) > 40
    files = {file for file, _ in named}
    found = {
        (file, node.name)
        for file in files
        for node in ast.parse((ROOT / "tests" / "unit" / file).read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef)
    }
    assert sorted(set(named) - found) == []


def test_every_claim_has_a_test_or_says_that_it_is_not_shown() -> None:
    page = (ROOT / "docs" / "validation" / "studies.md").read_text(encoding="utf-8")
    table = page[page.index("## Claims of the papers and their verification") :]
    rows = [line for line in table.splitlines() if line.startswith("| ") and "**" not in line]
    for row in rows[1:]:
        assert NAMED.search(row) or "not shown" in row, row
