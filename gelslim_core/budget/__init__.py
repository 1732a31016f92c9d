"""What accuracy costs in time: a budget, ladders of measured rungs, the times of this machine."""
