"""`check_late`: the retrodiction of late plots is correct, and so is its sigma."""

import pytest

from validation.tracker import check_late


@pytest.mark.parametrize(("density", "gain"), [(0.01, (0.05, 0.15)), (4.0, (0.0, 0.05))])
def test_retrodiction_is_as_accurate_as_filtering_again(
    monkeypatch: pytest.MonkeyPatch, density: float, gain: tuple[float, float]
) -> None:
    monkeypatch.setattr(check_late, "RUNS", 60)
    figures = [float(one.removesuffix(" m")) for one in check_late.row(density, 4.0)]
    rejected, retrodicted, exact, waited = figures[:4]
    assert retrodicted == pytest.approx(exact, abs=0.3)
    assert waited <= exact
    # This small gain is the reason for rejecting late plots.
    assert gain[0] < 1.0 - retrodicted / rejected < gain[1]
    assert all(0.85 < one < 1.15 for one in figures[8:])
