"""Process of one day: reads its job from standard input, writes progress and the answer.

Started by `multiradar.cluster.jobs`; it ends when its standard input closes.
"""

import json
import os
import sys
import threading

from multiradar_converters.leftovers import remove_leftovers

_CHUNK = 4096


def main() -> None:
    """Run one job."""
    # Libraries print to the standard output.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)

    def send(found: object) -> None:
        answers.write(json.dumps(found) + "\n")
        answers.flush()

    job = json.loads(sys.stdin.readline())
    threading.Thread(target=_end_with_command, daemon=True).start()
    # Imported when the process can already be ended.
    from multiradar.toolbox.messages.progress import progress_to
    from multiradar.toolbox.tracking.reprocessing.job import run_day

    with progress_to(lambda done, total: send([done, total])):
        answer = run_day(job)
    send(answer)


def _end_with_command() -> None:
    while os.read(0, _CHUNK):
        continue
    remove_leftovers()
    os._exit(1)


if __name__ == "__main__":
    main()
