"""ASTERIX in and out."""
