"""Models of what a sensor sees."""
