"""What the sensors of a scenario see: detections, noise, clutter, faults."""
