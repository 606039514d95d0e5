"""Status messages of ADS-B ground stations (023) in `multiradar convert asterix`."""

import json
from pathlib import Path

from multiradar.cli.main import EXIT_DONE, run
from support.asterix.octets import block, plot_048, record, time_of_day

SECONDS = 43_200.5
STATION = record((1, "14fb"), (2, "01"), (4, time_of_day(SECONDS)), (5, "05 14"), (7, "c8"))
SERVICE = record((1, "14fb"), (2, "02"), (3, "12"), (4, time_of_day(SECONDS)), (8, "08"))
STATISTICS = record(
    (1, "14fb"), (2, "03"), (3, "12"), (4, time_of_day(SECONDS)), (9, "01 03 80 0001e240")
)


def test_every_field_of_status_messages_is_read_and_counted(tmp_path: Path) -> None:
    path, out = tmp_path / "recording", tmp_path / "out"
    path.write_bytes(block(48, plot_048(1.0)) + block(23, STATION, SERVICE) + block(23, STATISTICS))
    assert run(["convert", "asterix", str(path), "--out", str(out), "--records"]) == EXIT_DONE
    report = json.loads((out / "report.json").read_bytes())
    assert report["counts"]["rejected"] == 0
    assert report["figures"]["records"] == {"023": 3, "048": 1}
    lines = [json.loads(line) for line in (out / "records.ndjson").read_text().splitlines()[1:]]
    source = {"010": {"SAC": 20, "SIC": 251}, "070": SECONDS}
    on = dict.fromkeys(("NOGO", "ODP", "OXT", "MSC", "TSV", "SPO", "RN"), 0) | {"SPO": 1}
    service = {"015": {"SID": 1, "STYP": 2}}
    assert [line["items"] for line in lines] == [
        source | {"000": 1, "100": on | {"GSSP": 10}, "200": 200},
        source | service | {"000": 2, "110": {"STAT": 4}},
        source | service | {"000": 3, "120": [{"TYPE": 3, "REF": 1, "CV": 123_456}]},
    ]
