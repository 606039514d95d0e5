"""Parsing of the text of a dump: lines in, columns of accepted rows out."""
