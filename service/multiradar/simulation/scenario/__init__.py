"""Scenarios: aircraft and sensors, read from and written to TOML."""
