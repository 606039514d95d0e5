"""Subscribers of a service under measurement."""
