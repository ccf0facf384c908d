"""canopen."""
