"""Neighbouring regions: their tracks, and which region is responsible for an aircraft."""
