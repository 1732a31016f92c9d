"""The order in which a finger is put together, and the proof that it can be."""
