"""Rates of climb, speeds and courses, by plots and as reported by aircraft."""
