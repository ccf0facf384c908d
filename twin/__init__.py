"""The batch twin: the controller's cycle and the plant in one compiled loop, without a bus.

It imports the laws of servo_ctrl and the plant of hil_sim; neither imports it. No study and no published
figure may enter.
"""
