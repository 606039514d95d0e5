"""The command line in a report of `track` is one that `track` accepts, with all that was given."""

import shlex
from pathlib import Path

from multiradar.toolbox.tracking.command_line import track_command
from multiradar.toolbox.tracking.request import TrackOptions
from support.paths import ROOT

DEFAULTS = ROOT / "tests" / "golden" / "defaults.txt"


def test_options_are_those_that_were_given() -> None:
    options: TrackOptions = {
        "date": "2018-08-01", "profile": None, "allow_missing": True, "trajectories": False,
        "acceleration_density": 2.5, "epoch_s": 0.1, "workers": 2,
        "config": Path("my settings.toml"), "cluster_listen": ["127.0.0.1", "::1"],
        "report": "page.html",
    }  # fmt: skip
    command = track_command(
        "a dump", "sensors.toml", "imm", kinds=frozenset({"radar", "adsb"}),
        hide=("mode_3a", "callsign"), out=Path("tracks"), options=options,
    )  # fmt: skip
    assert command == (
        "multiradar track 'a dump' --sensors sensors.toml --filter imm --kinds adsb,radar "
        "--hide callsign,mode_3a --out tracks --date 2018-08-01 --allow-missing "
        "--acceleration-density 2.5 --epoch-s 0.1 --workers 2 --config 'my settings.toml' "
        "--cluster-listen 127.0.0.1 --cluster-listen ::1 --report page.html"
    )


def test_every_option_is_one_of_the_command() -> None:
    known = {
        line.split()[2].rstrip(":")
        for line in DEFAULTS.read_text(encoding="utf-8").splitlines()
        if line.startswith("multiradar track --")
    }
    # Each with a text: only the names matter.
    options: TrackOptions = dict.fromkeys(TrackOptions.__annotations__, "x")  # type: ignore[assignment]  # as above
    command = track_command(
        "m", "s", "imm", kinds=["radar"], hide=["callsign"], out="o", options=options
    )
    named = {part for part in shlex.split(command) if part.startswith("--")}
    assert named == known - {"--json"}
