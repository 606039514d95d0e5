"""Reports: tables as text, plots as SVG, one self-contained HTML page."""
