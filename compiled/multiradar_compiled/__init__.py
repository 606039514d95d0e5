"""Compilation of functions, its cache, and ahead-of-time compilation."""
