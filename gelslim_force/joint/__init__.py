"""Contact forces of an object of unknown shape, from light and markers together."""
