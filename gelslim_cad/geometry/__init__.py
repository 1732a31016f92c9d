"""Closed forms of one finger that its parts, light and sensor share."""
