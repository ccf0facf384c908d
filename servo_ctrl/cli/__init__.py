"""The command line `servo-ctrl`: one subcommand a file, its options, and what it prints.

A file that declares a subcommand imports at its top only typer and the options; its function imports the work
when it runs. So `--help` and a wrong option load neither the control law nor the bus.
Nothing outside imports from here, but the studies, which are subcommands of `servo-ctrl experiment`.
"""
