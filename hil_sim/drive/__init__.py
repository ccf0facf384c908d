"""The servo amplifier of one axis on the bus, after CiA 402: states, modes of operation, stops and homing.

A drive is a device of `hil_sim.node`. It reads and commands the plant's records through `axis_port` alone.
"""
