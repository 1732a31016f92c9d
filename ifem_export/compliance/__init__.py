"""Columns of a pad's surface compliance, exact up to its edge."""
