"""Multiple-hypothesis trajectory sets."""
