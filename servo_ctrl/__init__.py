"""servo_ctrl."""

import os

# Before Arrow is imported: its own allocator reserves 1 GiB, which --fifo would make resident (mlockall).
os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")
