"""The batch twin: the controller's cycle and the plant in one compiled loop, without a bus.

It imports servo_ctrl's laws and hil_sim's plant; neither imports it. No study or published figure may enter.
"""
