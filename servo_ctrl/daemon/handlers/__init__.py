"""Executes the commands of `servo_ctrl.commands`, or refuses them with a reason."""
