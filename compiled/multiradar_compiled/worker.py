"""One of the processes that compile kernels beforehand: a request a line in, an answer a line out.

Started by `multiradar_compiled.ahead` as `python -m multiradar_compiled.worker PROCESS`; it ends
with that process.
"""

import json
import os
import sys
import threading
from importlib import import_module

from multiradar_compiled.signatures import parse

_LOOK_PERIOD_S = 0.5


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
    """Answer every request: an empty line when it is compiled, else what is wrong."""
    threading.Thread(target=_end_with_parent, args=(int(sys.argv[1]),), daemon=True).start()
    for line in sys.stdin:
        request = json.loads(line)
        try:
            compile_kernel(request["kernel"], request["arguments"])
            answer = ""
        except Exception as error:
            # The kernel will be compiled, or will fail, where it is called.
            answer = f"{request['kernel']}: {type(error).__name__}: {error}".replace("\n", " ")
        sys.stdout.write(answer + "\n")
        sys.stdout.flush()


def _end_with_parent(parent: int) -> None:
    # A command that is stopped leaves nobody behind who compiles for it.
    never = threading.Event()
    while os.getppid() == parent:
        never.wait(_LOOK_PERIOD_S)
    os._exit(1)


if __name__ == "__main__":
    main()
