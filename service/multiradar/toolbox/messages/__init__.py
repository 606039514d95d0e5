"""Messages of a running function: progress and warnings."""
