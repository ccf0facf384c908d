"""From the commanded current to the motor's force. One effect, one file."""
