"""A conformance suite for CANopen nodes: scripted dialogues, clause by clause, that never switch a motor on.

`clauses` holds what is asked, `dialogue` how, `verdicts` what comes of it. It knows a node by its EDS alone.
"""
