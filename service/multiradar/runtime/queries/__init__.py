"""Queries of live tracks: forecasts, encounters, windows of measurements."""
