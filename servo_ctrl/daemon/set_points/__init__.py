"""The set points of each cycle: programs, feed hold, jogging and the ramp of a controlled stop."""
