"""Decoding of live ASTERIX datagrams in batches."""
