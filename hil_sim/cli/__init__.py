"""The command line `hil-sim`: one subcommand a file.

A subcommand's file imports only typer at its top; its function imports the simulator when it runs, so that
`--help` and a wrong option are answered at once.
"""
