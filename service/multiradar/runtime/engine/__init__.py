"""The engine: measurements in, updates of tracks and shared biases out."""
