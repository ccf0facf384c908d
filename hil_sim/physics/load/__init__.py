"""Forces from outside, and masses. One effect, one file."""
