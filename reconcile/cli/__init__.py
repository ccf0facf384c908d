"""The command line `reconcile`: one subcommand a file, its options, and what it prints.

A file that declares a subcommand imports at its top only typer and options; its function imports the work
when it runs, so that `--help` and a wrong option are answered at once.
"""
