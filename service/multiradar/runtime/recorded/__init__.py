"""A run of `track` on disk, read as the service reads its memory."""
