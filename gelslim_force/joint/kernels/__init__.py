"""Compiled loops of the fit: nodes, light, finer pressure, places and regions."""
