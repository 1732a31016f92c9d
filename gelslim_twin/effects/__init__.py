"""The physical effects of the twin, one declaration each: needs, error bound, rungs and times."""
