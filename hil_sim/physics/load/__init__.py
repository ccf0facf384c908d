"""Forces from outside. One effect, one file."""
