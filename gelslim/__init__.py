"""Tactile fingers of the GelSlim type: the command line and the public names."""
