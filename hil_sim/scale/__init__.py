"""The linear scale of one axis on the bus, after CiA 406: a device of `hil_sim.node` that reads the plant.

Only what CiA 406 defines for an encoder may enter; errors of the grating are effects of `physics.sensor`.
"""
