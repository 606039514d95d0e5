"""Motion models with coupled axes."""
