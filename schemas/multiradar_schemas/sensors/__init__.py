"""Sensors and their bias priors: `sensors.toml`."""
