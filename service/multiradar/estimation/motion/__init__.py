"""Models of how an aircraft moves."""
