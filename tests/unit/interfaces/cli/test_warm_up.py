"""`multiradar warm-up` as a user calls it: which kernels it compiles."""

from collections.abc import Iterable

import pytest

from multiradar.cli import warm_up
from multiradar.cli.main import run
from multiradar_compiled.kernel_list import kernels_by_purpose


def test_what_is_rarely_run_is_compiled_only_if_all_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[set[str]] = []

    def compiled(purposes: Iterable[str]) -> int:
        asked.append(set(purposes))
        return 7

    monkeypatch.setattr(warm_up, "compile_kernels", compiled)
    assert run(["warm-up"]) == run(["warm-up", "--all"]) == 0
    usual, everything = asked
    assert usual
    assert everything == set(kernels_by_purpose())
    left = everything - usual
    assert {one for one in everything if one.startswith("study ")} < left
    assert capsys.readouterr().out.startswith("7 kernels compiled into ")
