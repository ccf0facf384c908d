"""From SYNC to RPDO: the cycle, the machine controller of all axes, and the process's real-time settings.

May enter: code that runs in the cycle's thread at every tick, and the worker that takes long work out of it.
"""
