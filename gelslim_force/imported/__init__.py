"""A bundle for a marker sensor that was not generated here: its description and its picture."""
