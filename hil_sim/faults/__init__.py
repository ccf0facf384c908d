"""What breaks under way: one fault a file, found by its name; it begins at an instant and stays.

A module has `Params`, `check` (refuses an axis that cannot have it), `begin`, and `end` where it passes. Here
is only what breaks the table, a node or its supply; faults of the bus are injected by tests.
"""
