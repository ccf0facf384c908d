"""Faults that begin during a run: one fault, one file, found by its name.

A module has `Params` and `begin`, `check` where not every axis can have the fault, and `end` where it passes.
Only faults of the table, a node or its supply may enter; faults of the bus are injected by tests.
"""
