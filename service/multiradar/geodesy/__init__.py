"""WGS 84, the system plane and slant range."""
