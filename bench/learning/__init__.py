"""Benches of data sets and of the networks that learn from them."""
