"""The air picture: what the page at `/` shows, as binary frames."""
