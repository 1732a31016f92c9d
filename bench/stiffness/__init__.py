"""Benches of the pad's stiffness: mesh, assembly, operators."""
