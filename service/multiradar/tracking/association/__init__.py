"""Which plot is of which aircraft, where no identity says so."""
