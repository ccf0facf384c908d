"""What is added to the commands of the cascade: one compensation, one file.

A file holds the law, its `Params` and `State`, what stands in their place without it (`NEUTRAL`), and
`SECTION`, which says what the machine file has of it. `control.tick` names each where it acts; config, the
records, the documents' tables and the tests derive the rest.
"""
