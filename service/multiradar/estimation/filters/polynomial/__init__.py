"""The polynomial filter."""
