"""Paths: what follows them, and what they do to an arm."""
