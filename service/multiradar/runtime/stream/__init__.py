"""Numbered events and their encoding."""
