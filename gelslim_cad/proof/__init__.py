"""Proofs of files as written: each is read back by other code and measured against the part."""
