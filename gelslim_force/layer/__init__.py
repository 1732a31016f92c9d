"""Exact solutions of contacts on a bonded elastic layer."""
