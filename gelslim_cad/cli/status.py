"""Exit statuses."""

OK = 0
RULE_FAILED = 1
BAD_INPUT = 2
FAULT = 3
CLOSED_PIPE = 141
