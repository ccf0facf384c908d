"""servo_ctrl."""
