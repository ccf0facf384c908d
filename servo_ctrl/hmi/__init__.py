"""The operator's bench: a process of its own that shows the machine to browsers and takes their commands.

It meets the controller on the local socket only (docs/local_socket.md, docs/operator_page.md).
"""
