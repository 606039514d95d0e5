"""Conversion of recordings to normalised measurements, without sockets and clocks."""
