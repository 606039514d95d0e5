"""Encounters: which aircraft are expected to come near each other, when, and how near."""
