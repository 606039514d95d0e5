"""Truth of the sample recording: date, sites and true biases of its radars."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from multiradar.errors import InputError
from multiradar_schemas.documents.contents import content

TRUTH_FILE = "truth.json"
_HERE = Path(__file__).resolve()
#: The sample in the repository, and where the wheel installs it.
_SAMPLES = (
    _HERE.parents[4] / "examples" / "vid-sample",
    _HERE.parents[3] / "multiradar_examples" / "vid-sample",
)


@dataclass(frozen=True, slots=True)
class Truth:
    """Known facts about a recording.

    Attributes
    ----------
    date : str or None
        Date of its first line, YYYY-MM-DD.
    biases : dict
        True bias (measured minus true) by sensor and parameter; empty when unknown.
    sensors_toml : str or None
        Text of a sensors file with the sites and noise, but without the biases.
    """

    date: str | None
    biases: dict[tuple[str, str], float]
    sensors_toml: str | None


def sample_folder() -> Path:
    """Return the folder of the sample recording.

    Raises
    ------
    InputError
        In an installation without the examples.
    """
    for folder in _SAMPLES:
        if folder.is_dir():
            return folder
    msg = f"{_SAMPLES[-1]}: sample recording not found; specify a dump with --dump"
    raise InputError(msg)


def read_truth(dump: Path) -> Truth:
    """Read `truth.json` of a dump; a dump without one has no truth.

    Raises
    ------
    InputError
        The file exists but cannot be used.
    """
    path = dump / TRUTH_FILE
    if not path.exists():
        return Truth(date=None, biases={}, sensors_toml=None)
    return read_truth_file(path)


def read_truth_file(path: Path) -> Truth:
    """Read a file such as `truth.json`.

    Raises
    ------
    InputError
        It cannot be used.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        radars = document["radars"]
        return Truth(
            date=document.get("date"),
            biases=dict(pair for radar in radars for pair in _biases(radar)),
            sensors_toml="\n".join([*(_radar_toml(radar) for radar in radars), _ADSB_TOML]),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        what = f"missing {error}" if isinstance(error, KeyError) else str(error)
        found = content(path)
        was = "" if found in (None, "JSON") else f"was {found}, "
        msg = f"{path}: not a valid truth file: {was}{what}"
        raise InputError(msg) from error


def _biases(radar: dict[str, Any]) -> list[tuple[tuple[str, str], float]]:
    sensor = f"{radar['source']}-{radar['sensor']}"
    return [
        ((sensor, "range_offset_m"), float(radar["bias_range"])),
        ((sensor, "azimuth_offset_deg"), float(radar["bias_azimuth_deg"])),
    ]


_ADSB_TOML = """\
[[sensor]]
id = "adsb"
kind = "adsb"
"""


def _radar_toml(radar: dict[str, Any]) -> str:
    return f"""\
[[sensor]]
source = {radar["source"]:d}
sensor = {radar["sensor"]:d}
kind = "radar"
latitude_deg = {radar["lat"]!r}
longitude_deg = {radar["lon"]!r}
height_m = {radar["h"]!r}
range_sigma_m = {radar["sigma_range"]!r}
azimuth_sigma_deg = {radar["sigma_azimuth_deg"]!r}
rotation_period_s = {radar["period"]!r}
range_max_m = {radar["max_range"]!r}
"""
