"""Motion models that the studies compare."""
