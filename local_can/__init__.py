"""A CAN bus in user space: a hub on a Unix socket, and the python-can interface `localcan` to it.

Other packages use it only by its interface name, and none imports it. It sees `can_frames` and `kernels`.
"""
