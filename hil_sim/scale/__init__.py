"""The linear scale of one axis on the bus, after CiA 406: a device of `hil_sim.node` that reads the plant."""
