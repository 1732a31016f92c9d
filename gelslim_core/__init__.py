"""What the other packages stand on and what knows nothing of fingers."""

__version__ = "0.1.0"
