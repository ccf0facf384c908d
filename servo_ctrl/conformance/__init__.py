"""A conformance suite for CANopen nodes: scripted dialogues, clause by clause, that never switch a motor on.

`clauses` lists the requirements, `dialogue` sends and receives frames, `verdicts` formats the result. The
suite knows a node by its EDS alone.
"""
