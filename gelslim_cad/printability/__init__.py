"""Whether the printed parts can be printed well: walls, overhangs, bridges, holes, first layer."""
