"""A recording through the same engine, to tables on disk."""
