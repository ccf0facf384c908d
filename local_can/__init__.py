"""A CAN bus in user space: a hub on a Unix socket, and python-can's interface `localcan` to it.

Reached by its interface name alone: no package of ours imports it, and it imports none of them.
"""
