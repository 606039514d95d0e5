"""The page of fields says what the models say."""

from pathlib import Path

from multiradar_schemas.fields import page
from multiradar_schemas.reject import CODE_MEANINGS, RejectCode

ROOT = Path(__file__).parents[3]


def test_the_page_is_that_of_the_models() -> None:
    written = (ROOT / "docs" / "fields.md").read_text(encoding="utf-8")
    assert written == page(), "run python -m multiradar_schemas.fields docs/fields.md"


def test_every_code_has_a_meaning() -> None:
    assert set(CODE_MEANINGS) == set(RejectCode)
