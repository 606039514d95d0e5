"""Text dumps of VID recordings: three files become aircraft folders and one table."""
