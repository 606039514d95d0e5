"""What the Python API and the commands do alike: convert, track, evaluate, simulate, study."""
