"""Commands that try a finger before it is built."""
