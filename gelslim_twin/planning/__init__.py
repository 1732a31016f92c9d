"""The choice of effects: which ones a scene needs, how finely, and what that costs."""
