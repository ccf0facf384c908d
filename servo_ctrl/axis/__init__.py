"""One axis: its drive's sequence, its supervision, and the reactions to events (`fault_policy`).

May enter: code that joins the compiled cycle to one axis, and the tables and bounds of its reactions.
"""
