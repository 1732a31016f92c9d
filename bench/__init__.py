"""Benches: commands that measure error, time and worth, and make the pages of what they found."""
