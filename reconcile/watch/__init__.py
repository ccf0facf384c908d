"""`reconcile watch`: compares each new recording of a machine with the earlier ones.

It finds complete recordings (`recording_folder`), condenses each into indicators (`indicators`), stores them
(`history`), detects and dates a change of them (`change_detection`), describes it (`change`), locates it
(`compare`), names it by two diagnoses (`change_diagnosis`), and reports it (`page`, `publisher`).
"""
