"""Waiting for a signal, and what is done meanwhile."""

import signal

import pytest

from multiradar.cli.terminal import stop_signals


def test_it_acts_every_few_seconds_until_a_signal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stop_signals, "_PIECE_S", 0.001)
    acts = []

    def act() -> None:
        acts.append(1)
        if len(acts) == 3:
            signal.raise_signal(signal.SIGTERM)

    before = signal.getsignal(signal.SIGTERM)
    with stop_signals.stop_on_signals() as stop:
        stop.started()
        stop.wait(act)
    assert len(acts) == 3
    assert signal.getsignal(signal.SIGTERM) is before
