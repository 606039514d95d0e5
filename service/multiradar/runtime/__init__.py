"""The tracking engine, the live pipeline, offline runs, queries and trajectory bundles."""
