"""Data sets for learning: samples drawn from a scene, written in shards of several formats."""
