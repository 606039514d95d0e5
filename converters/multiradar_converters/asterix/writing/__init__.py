"""ASTERIX written: system tracks, status, and recordings sent again."""
