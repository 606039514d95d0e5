"""ASTERIX recordings become measurements: blocks, records, items, fields."""
