"""Polynomial forecasts."""
