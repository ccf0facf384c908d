"""Access to the operating system in real time: the CAN bus and the clock; nothing else may enter."""
