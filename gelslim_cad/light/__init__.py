"""How this finger is lit: scenes of its guide and of the older kind, traced and compared."""
