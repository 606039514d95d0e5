"""Forecasts by polynomials."""
