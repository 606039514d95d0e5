"""Durable storage: the journal, recordings and output files."""
