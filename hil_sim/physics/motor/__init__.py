"""From the current that is asked for to the motor's force. One effect, one file."""
