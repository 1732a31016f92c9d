"""Contact of a rigid tool with the gel: shapes, compliance, sticking and slipping, large strain."""
