"""Association of plots with tracks."""
