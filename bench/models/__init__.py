"""Models of lens, guide and surface that share no code with those they judge."""
