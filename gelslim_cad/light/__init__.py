"""The finger's light: its guide and straight guides, traced and compared."""
