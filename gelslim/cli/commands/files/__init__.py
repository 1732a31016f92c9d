"""Commands that make the files of a finger."""
