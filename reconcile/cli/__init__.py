"""The command line `reconcile`: one subcommand per file, its options, and its output.

A file that declares a subcommand imports only typer and options at its top; its function imports the rest
when it runs, so that `--help` and usage errors are fast.
"""
