"""Forces of a run against forces that were measured otherwise."""
