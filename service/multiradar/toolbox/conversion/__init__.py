"""Converting recordings."""
