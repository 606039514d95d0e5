"""The experiments behind the figures of the documents, by subject."""
