"""Several fingers from one parametric design: built, listed and drawn side by side."""
