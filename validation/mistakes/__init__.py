"""Mistakes of users, and the messages for them."""
