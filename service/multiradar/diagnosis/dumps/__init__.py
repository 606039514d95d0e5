"""Diagnosis of a dump: its files compared with each other."""
