"""What the bus is told of the positions: encoder and grating scale. One effect, one file."""
