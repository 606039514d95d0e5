"""The trajectory bundle and its search as published in the report."""
