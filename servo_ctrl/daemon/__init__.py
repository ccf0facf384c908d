"""The controller as a process: what happens in a cycle, in a run, and beside both.

Rooms from the bottom up: `set_points`, `cycle`, `learning`, `handlers` and `page`, `run`. A room imports from
those below it only.
"""
