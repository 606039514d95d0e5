"""Simulation of scenarios: truth and sensor measurements, from a seed."""
