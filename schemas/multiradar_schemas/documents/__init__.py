"""Configuration files: TOML parsed into models, with the location of every error."""
