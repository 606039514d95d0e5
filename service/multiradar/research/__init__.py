"""Reproduction of the source papers: studies, sequential filters, motion models, bundle search."""
