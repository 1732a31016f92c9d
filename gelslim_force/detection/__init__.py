"""Marker centres in one picture."""
