"""Records into target reports, service messages, system tracks and sensor status."""
