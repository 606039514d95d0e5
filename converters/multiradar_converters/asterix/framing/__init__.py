"""Blocks in files, captures and datagrams."""
