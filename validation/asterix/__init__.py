"""ASTERIX input and output."""
