"""Text dumps of VID recordings: three files are converted to aircraft folders and one table."""
