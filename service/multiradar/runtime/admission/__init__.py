"""Admission of measurements by time, and records of rejected ones."""
