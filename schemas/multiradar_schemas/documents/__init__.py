"""Files that people write: TOML read into models, with every mistake located."""
