"""Proofs of written files: each is read back by other code and compared with its part."""
