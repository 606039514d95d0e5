"""System tracks, sensor status and service status in ASTERIX, made of what the engine puts out."""
