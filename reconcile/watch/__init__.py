"""`reconcile watch`: compare each new recording of a machine with those before it.

A recording is condensed into indicators (`indicators`), a change among them is detected and dated
(`change_detection`), described (`change`), located (`compare`) and named by two diagnoses
(`change_diagnosis`).
"""
