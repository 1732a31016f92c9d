"""Effects: one declaration each of what it needs, gives, costs and what leaving it out costs."""
