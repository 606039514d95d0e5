"""Tracks from bearings alone."""
