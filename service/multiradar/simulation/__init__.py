"""Scenes: truth and what sensors see of it, from a seed."""
