"""A CAN bus in user space: a hub on a Unix socket, and python-can's interface `localcan` to it."""
