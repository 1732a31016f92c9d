"""What presses of a ball tell of a built sensor: its gel and its light."""
