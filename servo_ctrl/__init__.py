"""A servo controller for CANopen drives (CiA 402) and linear scales (CiA 406)."""

import os

# Before Arrow is imported: its own allocator reserves 1 GiB, which --fifo would make resident (mlockall).
os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")
