"""The process of a day, which waits before it ends: until it is killed, or its command ends.

Run as a program in place of the worker of `reprocess`; the environment names the day and a file
that it makes when it waits.
"""

import json
import os
import threading
from pathlib import Path

from multiradar.toolbox.tracking.reprocessing import job, worker
from multiradar_converters.leftovers import register_leftover

DAY, FILE = "HANGING_DAY", "HANGING_FILE"


def hang(given: dict[str, object]) -> dict[str, object]:
    """Leave partial output, as in the middle of the day, and wait."""
    if given["day"]["date"] != os.environ[DAY]:  # type: ignore[index]  # a job
        return run(given)
    out = Path(str(given["out"]))
    partial = out.with_name(f".{out.name}.partial-test")
    register_leftover(partial)
    partial.mkdir()
    (partial / "tracks.parquet").write_bytes(b"half")
    waiting = Path(os.environ[FILE])
    ready = waiting.with_suffix(".ready")
    ready.write_text(json.dumps({"process": os.getpid(), "partial": str(partial)}))
    ready.rename(waiting)
    threading.Event().wait()
    return {}


run = job.run_day

if __name__ == "__main__":
    job.run_day = hang  # type: ignore[assignment]  # in this process
    worker.main()
