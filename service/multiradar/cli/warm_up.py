"""`multiradar warm-up`: compile the kernels of the other commands in advance."""

from typing import Annotated

import typer

from multiradar.toolbox.compiling import compile_kernels

#: Filters and studies that are rarely run.
_RARE = ("study ", "joint", " blom", " ci")


def warm_up(
    *,
    everything: Annotated[
        bool,
        typer.Option(
            "--all",
            help="Also compile the filters joint, blom, blom-macro and ci, and the studies.",
        ),
    ] = False,
) -> None:
    """Compile the kernels of the usual commands and filters in advance (--all: also of the others).

    The compiled kernels remain in the user's cache directory until the program changes.
    """
    from multiradar_compiled.cache import kernel_folder
    from multiradar_compiled.kernel_list import kernels_by_purpose

    purposes = [
        purpose
        for purpose in kernels_by_purpose()
        if everything or not any(part in purpose for part in _RARE)
    ]
    missing = compile_kernels(purposes)
    print(f"{missing} kernels compiled into {kernel_folder()}")
