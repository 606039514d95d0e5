"""Forecasts of tracks, with regions that hold a given probability."""
