"""`multiradar demo`."""
