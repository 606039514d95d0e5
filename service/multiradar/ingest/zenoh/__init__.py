"""Zenoh: measurements in, tracks and biases out, over one session."""
