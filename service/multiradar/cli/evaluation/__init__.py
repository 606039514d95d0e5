"""`multiradar evaluate`."""
