"""Independent tasks on this machine's processors or on a cluster; knows nothing of what they do."""
