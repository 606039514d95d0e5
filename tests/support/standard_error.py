"""Standard error of commands in the process of a test."""

import pytest


def errors(capsys: pytest.CaptureFixture[str]) -> str:
    """Return standard error without the progress of compilation, which depends on the cache."""
    lines = capsys.readouterr().err.splitlines(keepends=True)
    return "".join(one for one in lines if not one.startswith("multiradar: compiling kernels"))
