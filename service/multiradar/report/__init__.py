"""Reports: tables as text, plots as SVG, one HTML page that needs nothing else."""
