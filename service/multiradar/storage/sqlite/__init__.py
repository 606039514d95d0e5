"""The journal on disk: SQLite, its write-ahead log, the chain of digests and the tip."""
