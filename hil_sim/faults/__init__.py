"""Faults that begin during a run: one fault, one file, found by its name.

A module has `Params` and `begin`, `check` if not every axis can have the fault, `end` if the fault ends after
a time. Only faults of the mechanics, a node or its supply may enter; tests inject faults of the bus.
"""
