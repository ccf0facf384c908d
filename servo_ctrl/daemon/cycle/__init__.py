"""From SYNC to RPDO: the cycle, the machine of all axes in it, and what keeps a Python process in time.

May enter: what runs in the thread of the cycle at every tick, and the worker that takes long work out of it.
"""
