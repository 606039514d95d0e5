"""Forecasts from a bundle: weighted members with covariances."""
