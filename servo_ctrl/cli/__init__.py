"""The command line `servo-ctrl`: one file per subcommand, its options, and its output.

A file that declares a subcommand imports only typer and the options at its top; its function imports the rest
when it runs, so that `--help` and a wrong option load neither the control law nor the bus. Nothing outside
imports from here except the studies, which are subcommands of `servo-ctrl experiment`.
"""
