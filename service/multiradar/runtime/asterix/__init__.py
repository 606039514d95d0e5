"""System tracks, sensor status and service status in ASTERIX, from the output of the engine."""
