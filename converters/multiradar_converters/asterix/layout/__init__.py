"""Layouts of categories and editions, and their compiled parser."""
