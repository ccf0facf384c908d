"""local_can."""
