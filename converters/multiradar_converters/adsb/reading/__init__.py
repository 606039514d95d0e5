"""Parsing of ADS-B files into columns: records, cells, numbers and times."""
