"""Effects of the motor: winding, cogging. One effect, one file."""
