"""Checks of a sensor by its own measurements."""
