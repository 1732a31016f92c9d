"""Thousands of designs at once: their dimensions, rules, light and force error."""
