"""Mistakes of users, and what is said of them."""
