"""The programs behind the figures of the documents, by subject."""
