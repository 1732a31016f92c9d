"""Files and folders that are there whole or not at all, whoever else writes there or is killed."""
