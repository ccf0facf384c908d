"""A simulated machine as a context manager and as a pytest plugin, for HIL tests of any controller.

Only code that starts the simulator as a separate process and provides its bus may enter.
"""
