"""Simulated measurements of the sensors of a scenario: detections, noise, clutter, faults."""
