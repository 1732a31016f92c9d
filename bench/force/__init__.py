"""Benches of the force pipeline: its ladders, its latency, its stated uncertainty, its pictures."""
