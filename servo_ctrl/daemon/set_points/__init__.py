"""Where the axes are led, cycle by cycle: programs, feed hold, jogging and the ramp of a controlled stop."""
