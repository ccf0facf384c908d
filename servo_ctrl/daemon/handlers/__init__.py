"""Carries out the commands of `servo_ctrl.commands`, or says why not; one file for each kind of command."""
