"""Height and rate of climb."""
