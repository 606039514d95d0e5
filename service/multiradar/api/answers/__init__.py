"""Answers of the REST API: tables, documents, pages and their encoding."""
