"""Sensors and what is known of their biases: `sensors.toml`."""
