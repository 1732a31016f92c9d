"""Benches of designs: batches, tessellation of the parts, yields."""
