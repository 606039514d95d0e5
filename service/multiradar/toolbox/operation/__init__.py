"""Operation of a service: backup, archive, verification, restoration, and advice."""
