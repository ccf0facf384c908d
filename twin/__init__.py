"""The batch twin: control law and plant in one compiled loop, without a bus.

Sees servo_ctrl's laws and hil_sim's plant; neither sees it. Nothing here knows a study or a published figure.
"""
