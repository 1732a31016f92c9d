"""The commands of `gelslim`, one module for each."""
