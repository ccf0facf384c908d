"""One CANopen slave on the bus, whatever its profile: dictionary, SDO, PDO, NMT, EMCY, stored parameters."""
