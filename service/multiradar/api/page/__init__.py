"""The built page; its source is in `page/`."""
