"""Inspection of several recordings as one, each by its form."""

import gzip
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from multiradar_converters.adsb.day_times import day_clocks
from multiradar_converters.asterix.decoding.editions import Editions
from multiradar_converters.asterix.decoding.local_plane import ReferencePoint
from multiradar_converters.errors import LayoutError
from multiradar_converters.inspection.asterix_input import DETAILED_OCTETS_MAX, inspect_asterix
from multiradar_converters.inspection.survey import Survey
from multiradar_converters.inspection.text_inputs import inspect_adsb, inspect_dump
from multiradar_schemas.documents.contents import DUMP, GZIP, MEASUREMENTS, PACKED, content

_HEAD = 4096
#: Contents that a recording may have; its reader has more to say of these.
_RECORDED = (DUMP, "JSON", "Parquet", *(form for _, form in PACKED), "an empty file")
#: In any encoding of text; DEL and the other control characters are not.
_TEXT = frozenset(b"\t\n\r") | frozenset(range(0x20, 0x100)) - {0x7F}
_BOM = b"\xef\xbb\xbf"


@dataclass(frozen=True)
class InspectionOptions:
    """Options of an inspection.

    Attributes
    ----------
    editions : Editions
        Selected editions; found ones are added.
    detailed_octets_max : int
        ASTERIX recordings of more octets are sampled for the figures of plots.
    references : mapping
        Reference points of local coordinates by source.
    """

    editions: Editions = field(default_factory=Editions)
    detailed_octets_max: int = DETAILED_OCTETS_MAX
    references: Mapping[int, ReferencePoint] = field(default_factory=dict)


def inspect(
    files: Sequence[Path], options: InspectionOptions, advance: Callable[[int], None]
) -> Survey:
    """Inspect recordings.

    Parameters
    ----------
    files : sequence of Path
        ASTERIX recordings and ADS-B trajectories in order of time, and folders of text dumps.
    options : InspectionOptions
        Options.
    advance : callable
        Called with octets read, from time to time.

    Returns
    -------
    Survey
        What they contain.

    Raises
    ------
    LayoutError
        A file cannot be read, or is no recording.
    """
    survey = Survey(references=dict(options.references))
    forms = {path: recording_kind(path) for path in files}
    octets = sum(path.stat().st_size for path, form in forms.items() if form == "asterix")
    every = max(1, -(-octets // options.detailed_octets_max))
    survey.sampled = 1.0 / every
    trajectories = [path for path, form in forms.items() if form == "adsb"]
    clocks = dict(zip(trajectories, day_clocks(trajectories), strict=True))
    survey.order.moved += [one.note for one in clocks.values() if one is not None and one.note]
    for path, form in forms.items():
        if form == "asterix":
            inspect_asterix(path, survey, options.editions, advance, every)
        elif form == "dump":
            inspect_dump(path, survey, advance)
        else:
            inspect_adsb(path, survey, advance, clocks[path])
    return survey


def recording_kind(path: Path) -> str:
    """Return asterix, adsb or dump.

    Raises
    ------
    LayoutError
        The path is nothing that can be inspected.
    """
    check_recording(path)
    if path.is_dir():
        return "dump"
    head = _head(path)
    if not head:
        msg = f"{path}: the file is empty"
        raise LayoutError(msg)
    packed = head.startswith(GZIP)
    text = _unpacked(head) if packed else head
    if not _is_text(text):
        # The reader of ASTERIX rejects compressed files.
        return "asterix"
    if path.name in ("plots.txt", "tracks.txt", "plots_ads.txt"):
        msg = f"{path}: this file belongs to a text dump; specify the directory {path.parent}"
        raise LayoutError(msg)
    return "adsb"


def check_recording(path: Path) -> None:
    """Check that a path is not known to be something else than a recording.

    Raises
    ------
    LayoutError
        It is; the message gives what.
    """
    found = content(path)
    if found not in (None, *_RECORDED):
        hint = "; specify the original recording" if found in MEASUREMENTS else ""
        raise LayoutError(f"{path}: expected a recording, found {found}{hint}")


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(_HEAD)
    except OSError as error:
        msg = f"{path}: cannot be read: {error.strerror}"
        raise LayoutError(msg) from error


def _unpacked(head: bytes) -> bytes:
    try:
        return zlib.decompressobj(wbits=31).decompress(head)
    except (zlib.error, gzip.BadGzipFile):
        return b""


def _is_text(head: bytes) -> bool:
    return bool(head) and all(octet in _TEXT for octet in head.removeprefix(_BOM))
