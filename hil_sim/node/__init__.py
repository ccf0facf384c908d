"""One CANopen slave (CiA 301), whatever its profile: dictionary, SDO, PDO, NMT, EMCY, stored parameters.

Nothing here knows drives, scales or the plant: these enter as a `node_host.Device` and its process objects.
"""
