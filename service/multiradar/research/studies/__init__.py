"""Studies that reproduce the tables and figures of the source papers."""
