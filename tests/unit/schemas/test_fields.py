"""The page of fields matches the models."""

from pathlib import Path

import pytest

from multiradar_schemas import export, fields
from multiradar_schemas.fields import page
from multiradar_schemas.reject import CODE_MEANINGS, RejectCode
from support.paths import ROOT


def test_the_page_is_that_of_the_models() -> None:
    written = (ROOT / "docs" / "reference" / "fields.md").read_text(encoding="utf-8")
    assert written == page(), "run python -m multiradar_schemas.fields docs/reference/fields.md"


def test_every_code_has_a_meaning() -> None:
    assert set(CODE_MEANINGS) == set(RejectCode)


def test_the_page_is_written_where_it_is_reported(tmp_path: Path) -> None:
    fields.main([str(tmp_path / "page.md")])
    assert (tmp_path / "page.md").read_text(encoding="utf-8") == page()


def test_a_place_that_cannot_be_written_is_reported_in_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        fields.main([str(tmp_path)])
    assert ended.value.code == 1
    assert capsys.readouterr().err == f"{tmp_path}: cannot be written (Is a directory)\n"


@pytest.mark.parametrize(
    ("command", "status"),
    [
        ("fields --help", 0),
        ("fields --out", 2),
        ("fields", 2),
        ("export --help", 0),
        ("export somewhere", 2),
    ],
)
def test_help_and_wrong_options_write_no_file(
    command: str,
    status: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Once, `--help` became the name of a file."""
    module, *arguments = command.split()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(export, "FOLDER", tmp_path / "json")
    with pytest.raises(SystemExit) as ended:
        {"fields": fields.main, "export": export.main}[module](arguments)
    assert ended.value.code == status
    reported = capsys.readouterr()
    assert f"usage: python -m multiradar_schemas.{module}" in reported.out + reported.err
    assert not list(tmp_path.iterdir())
