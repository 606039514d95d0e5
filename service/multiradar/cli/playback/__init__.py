"""`multiradar replay`."""
