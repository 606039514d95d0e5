"""Values in the forms of spreadsheets are named as such, and archives before their columns."""

from pathlib import Path

import pytest

from multiradar_converters.errors import LayoutError
from multiradar_converters.vid import fields
from multiradar_converters.vid.profile import Profile
from multiradar_converters.vid.text import lines
from multiradar_converters.vid.text.detection import detect


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        (b"57014,6", "decimal comma"),
        (b"57,014.6", "thousands separators"),
        (b'"57,014.6"', "thousands separators"),
        (b"57'014.6", "thousands separators"),
        (b"1\xc2\xa0057\xc2\xa0014.6", "thousands separators"),
        (b'"57014.6"', "quotation marks"),
        (b"57014.6 m", ""),
    ],
)
def test_a_number_of_a_spreadsheet_is_explained(text: bytes, hint: str) -> None:
    found = lines.form_hint(text)
    assert hint in found if hint else found == ""


@pytest.mark.parametrize(
    ("text", "octal", "hint"),
    [
        (b"21", True, lines.ZEROS_LOST),
        (b"819", True, "(a decimal number?)"),
        (b"12a9", True, ""),
        (b"c09df", False, lines.ZEROS_LOST),
        (b"4.00E+1234", False, "(read as a number by a spreadsheet?)"),
        (b"3934687", False, "(a decimal number?)"),
        (b"0x3c09df", False, "(without 0x)"),
        (b"3c09dg", False, ""),
    ],
)
def test_a_code_or_an_address_of_a_spreadsheet_is_explained(
    text: bytes, hint: str, *, octal: bool
) -> None:
    pattern, base = (lines._CODE, 8) if octal else (lines._ADDRESS, 16)
    with pytest.raises(lines.RejectedError) as caught:
        lines._coded(pattern, text, base, "digits")
    assert caught.value.reason == f"digits, was {text.decode()!r}{f' {hint}' if hint else ''}"


@pytest.mark.parametrize(
    ("octets", "what"),
    [
        (b"PK\x03\x04" + b"0" * 50, "found a ZIP archive or a spreadsheet; extract it, or export"),
        (b"BZh9" + b"0" * 50, "found a bzip2 file; extract it"),
        (b"7z\xbc\xaf" + b"0" * 50, "found a 7-Zip archive; extract it"),
        (b"PAR1" + b"0" * 50, "found a Parquet table"),
    ],
)
def test_an_archive_is_named(tmp_path: Path, octets: bytes, what: str) -> None:
    path = tmp_path / "plots.txt"
    path.write_bytes(octets)
    with pytest.raises(LayoutError, match=what):
        detect(path, fields.PLOTS, Profile())
