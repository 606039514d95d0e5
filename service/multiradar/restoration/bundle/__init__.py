"""The bundle of one aircraft, plot by plot: a multiple-hypothesis trajectory set."""
