"""CANopen: boot of the nodes, PDO codecs, heartbeats, and our own node with its SDO server.

May enter: what CiA 301, 402 and 406 describe, as seen by the master. The canopen library is behind `stack`.
"""
