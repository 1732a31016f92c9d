"""The regular grid that the markers form in the picture."""
