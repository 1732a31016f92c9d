"""Rigid tools at a pose: shapes, height over the gel, walls, undercuts, several at once."""
