"""Commands about this program itself."""
