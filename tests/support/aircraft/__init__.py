"""Aircraft-derived data written by hand from the specifications, independent of the decoder."""
