"""What can be read as a file, and what cannot."""

import gzip
from pathlib import Path

import pytest

from multiradar_converters.adsb.reading.unpacking import Unpacked, read_text
from multiradar_converters.errors import LayoutError


def _read(path: Path) -> bytes:
    return b"".join(read_text(Unpacked(path), lambda _: None))


def test_text_and_gzip_are_read(tmp_path: Path) -> None:
    text = b"time,lat,lon\n" * 3
    for name, content in (("a.csv", text), ("a.csv.gz", gzip.compress(text))):
        (tmp_path / name).write_bytes(content)
        unpacked, read = Unpacked(tmp_path / name), list[int]()
        assert b"".join(read_text(unpacked, read.append)) == text
        assert (unpacked.packed_bytes, unpacked.text_bytes) == (len(content), len(text))
        assert (read[-1], unpacked.damage) == (len(content), "")


@pytest.mark.parametrize(
    ("name", "words"), [("", "not a regular file"), ("none.csv", "cannot be read: No such file")]
)
def test_what_is_no_file_is_rejected(tmp_path: Path, name: str, words: str) -> None:
    with pytest.raises(LayoutError, match=words):
        _read(tmp_path / name)
