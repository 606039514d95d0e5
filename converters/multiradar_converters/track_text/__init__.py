"""Text files of tracks: `.plt` and `.new4`."""
