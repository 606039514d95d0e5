"""Scenarios: truth and sensors, read from and written to TOML."""
