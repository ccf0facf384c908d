"""The Drive page: position and state of each axis, power, homing, jogging, faults with advice."""
