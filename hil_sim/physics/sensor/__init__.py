"""Effects on the measured positions: encoder and grating scale. One effect, one file."""
