"""The simulated machine: drives (CiA 402) and linear scales (CiA 406) on a CAN bus, in front of a plant.

It meets the controller on the bus alone and imports nothing of it.
"""
