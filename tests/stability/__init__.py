"""Random specs across the whole legal range, each built and its outcome filed."""
