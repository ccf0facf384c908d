"""From screw to table: compliance, backlash, lead errors, growth. One effect, one file."""
