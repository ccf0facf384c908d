"""The operator's bench: a process of its own that shows the machine to browsers and sends their commands.

It reaches the controller by the local socket alone (docs/local_socket.md, docs/operator_page.md). Each page
has a room of its own and imports no other page; `shell` has what they share, `charts` the live charts, `link`
the connection, `access` who may do what.
"""
