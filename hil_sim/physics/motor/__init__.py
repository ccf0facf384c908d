"""Effects between the commanded current and the motor force. One effect, one file."""
