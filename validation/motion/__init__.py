"""Manoeuvres: filters, restoration, forecasts, encounters."""
