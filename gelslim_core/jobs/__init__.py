"""Independent tasks on the processors of this machine or on a cluster."""
