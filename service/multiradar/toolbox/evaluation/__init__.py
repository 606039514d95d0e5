"""Tracks, references and scorecards: what `evaluate` compares."""
