"""What commands write about a run: maps, pages, exports."""
