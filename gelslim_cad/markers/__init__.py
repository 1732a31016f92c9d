"""The marker print in every format, from one MarkerGrid."""
