"""Inspection of recordings before conversion: what they contain, in one pass and bounded memory."""
