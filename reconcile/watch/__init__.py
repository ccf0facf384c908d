"""`reconcile watch`: compares each new recording of a machine with the earlier ones.

It condenses a recording into indicators (`indicators`), detects and dates a change of them
(`change_detection`), describes it (`change`), locates it (`compare`), and names it by two diagnoses
(`change_diagnosis`).
"""
