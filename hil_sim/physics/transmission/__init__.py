"""Effects between screw and table: compliance, backlash, lead errors, expansion. One effect, one file."""
