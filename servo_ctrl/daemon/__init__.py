"""The controller as a process: the cycle, the run, and the services beside them.

Rooms from the bottom up: `set_points`, `cycle`, `learning`, `handlers` and `page`, `run`. A room imports
only from rooms below it.
"""
