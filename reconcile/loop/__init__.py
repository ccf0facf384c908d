"""`reconcile loop`: alternate motion and diagnosis until nothing is open.

The only room of reconcile that moves a machine: every motion is checked by servo_ctrl before it starts.
"""
