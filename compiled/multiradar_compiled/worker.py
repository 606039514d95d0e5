"""Worker process of ahead-of-time compilation: reads one request per line, writes one answer.

Started by `multiradar_compiled.ahead` as `python -m multiradar_compiled.worker PROCESS`; it ends
with that process.
"""

import gc
import json
import os
import sys
import threading
from importlib import import_module

from multiradar_compiled.signatures import parse

_POLL_PERIOD_S = 0.5
#: Allocations between two collections of cyclic garbage, in place of 700: collection took a quarter
#: of the time, and keeps at most 10 MB more with this number.
_COLLECTION_THRESHOLD = 100_000


def compile_kernel(kernel: str, arguments: list[str]) -> None:
    """Compile one kernel for arguments of given types, or load it if it is in the cache.

    Parameters
    ----------
    kernel : str
        As in `package.module:function`.
    arguments : list of str
        `signatures.describe` of each argument.
    """
    module, _, name = kernel.partition(":")
    dispatcher = getattr(import_module(module), name)
    dispatcher.compile(tuple(parse(one) for one in arguments))


def main() -> None:
    """Answer every request: an empty line on success, else the error message."""
    gc.set_threshold(_COLLECTION_THRESHOLD)
    threading.Thread(target=_end_with_parent, args=(int(sys.argv[1]),), daemon=True).start()
    for line in sys.stdin:
        request = json.loads(line)
        try:
            compile_kernel(request["kernel"], request["arguments"])
            answer = ""
        except Exception as error:
            # The kernel is compiled, or fails, where it is called.
            answer = f"{request['kernel']}: {type(error).__name__}: {error}".replace("\n", " ")
        sys.stdout.write(answer + "\n")
        sys.stdout.flush()


def _end_with_parent(parent: int) -> None:
    # A stopped command must not leave a worker behind.
    never = threading.Event()
    while os.getppid() == parent:
        never.wait(_POLL_PERIOD_S)
    os._exit(1)


if __name__ == "__main__":
    main()
