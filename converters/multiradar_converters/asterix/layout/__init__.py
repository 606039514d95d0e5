"""Layouts of categories and editions, and the compiled walk through them."""
