"""What is wrong with a request to explore."""


class ExploreError(ValueError):
    """The space cannot be explored as asked; the message says what, why and what to do."""
