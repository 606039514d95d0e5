"""Typed settings of the service, by section."""
