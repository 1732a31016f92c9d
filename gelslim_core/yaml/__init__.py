"""YAML read into frozen pydantic models; each fault with its line, limit and remedy."""
