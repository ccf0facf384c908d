"""What the nodes report of the positions: encoder and grating scale. One effect, one file."""
