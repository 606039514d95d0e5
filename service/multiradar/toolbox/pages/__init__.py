"""Pages of runs, and their plots."""
