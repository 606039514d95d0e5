"""`records.ndjson`: every field of every record, a line per record, in file order."""

import json
from pathlib import Path

from multiradar_converters.asterix.decoding.editions import source_name
from multiradar_converters.asterix.decoding.gathering import Rows
from multiradar_converters.asterix.framing.containers import Blocks
from multiradar_converters.asterix.layout.fields import record_fields
from multiradar_converters.asterix.layout.program import Walked


class RecordDump:
    """Collects the fields of the records of a file."""

    def __init__(self, blocks: Blocks) -> None:
        self._blocks = blocks
        self._lines: list[tuple[int, str]] = []

    def add(self, walked: Walked, rows: Rows) -> None:
        """Add records of one layout."""
        layout = walked.program.layout
        for order, offset, source, starts in zip(
            rows.order.tolist(),
            rows.offset.tolist(),
            rows.source.tolist(),
            walked.starts,
            strict=True,
        ):
            line = {
                "file": self._blocks.file,
                "offset": offset,
                "category": layout.category,
                "edition": layout.editions[0],
                "sensor": source_name(source),
                "items": record_fields(walked.program, self._blocks.data, starts),
            }
            self._lines.append((order, json.dumps(line, ensure_ascii=False)))

    def append_to(self, path: Path) -> None:
        """Append the lines to a file."""
        with path.open("a", encoding="utf-8", newline="\n") as file:
            file.writelines(f"{line}\n" for _, line in sorted(self._lines))
