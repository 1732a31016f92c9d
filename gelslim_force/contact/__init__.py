"""Where the gel is touched and how far it is pressed in."""
