"""The command `multiradar`, also as `python -m multiradar`."""

import gc
import os
import sys

from multiradar.cli.terminal.stopping import end_on_signals

# What is imported and loaded remains: with Python's own threshold the collection of garbage looks
# at it again and again, a tenth of the time of a short command.
_COLLECTION_THRESHOLD = 100_000


def main() -> None:
    """Run the command given by the arguments of the process and exit with its status."""
    # Ctrl-C while the command is imported, which takes half a second, must be no traceback.
    end_on_signals()
    gc.set_threshold(_COLLECTION_THRESHOLD)
    _open_closed_streams()
    # Matrices here are small. A second thread of the linear algebra would wait for the processor on
    # a machine with other work, and the first one for it. Read when numpy is imported, below.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from multiradar.cli.main import main as run_command

    run_command()


# Of a process started with closed streams (`>&-`) Python has none, and the first file that it opens
# would get their number, and what libraries print.
def _open_closed_streams() -> None:
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            mode = os.O_RDONLY if number == 0 else os.O_WRONLY
            opened = os.open(os.devnull, mode)
            if opened != number:
                os.dup2(opened, number)
                os.close(opened)
            setattr(sys, name, os.fdopen(number, "r" if number == 0 else "w", encoding="utf-8"))


if __name__ == "__main__":
    main()
