"""The command line `hil-sim`: one subcommand a file.

A subcommand's file imports only typer at its top; its function imports the simulator when it runs, so that
`--help` and an error in an option need no import of the simulator.
"""
