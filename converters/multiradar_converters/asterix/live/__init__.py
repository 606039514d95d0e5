"""ASTERIX from a network, batch after batch."""
