"""The engine: measurements in, track updates and shared biases out."""
