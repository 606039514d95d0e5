"""What the Python API and the commands share: convert, track, evaluate, simulate, study."""
