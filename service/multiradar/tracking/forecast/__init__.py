"""Forecasts of tracks, with regions of given probability."""
