"""A page in the browser that follows a spec file while it is edited."""
