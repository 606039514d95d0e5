"""Plots as points in space: manoeuvre plane, observability."""
