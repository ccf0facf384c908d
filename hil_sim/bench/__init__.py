"""A simulated machine as a context manager, and as a plugin of pytest: HIL tests of anybody's controller.

May enter: what starts the simulator as a process of its own and hands out its bus.
"""
