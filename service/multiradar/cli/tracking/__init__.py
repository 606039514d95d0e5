"""Commands that track recordings."""
