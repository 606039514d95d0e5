"""Conversion of ASTERIX recordings to measurements: blocks, records, items, fields."""
