"""Whether the positions that aircraft report are plausible."""
