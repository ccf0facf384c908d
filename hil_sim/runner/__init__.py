"""The simulator's process: the bench of plant and nodes, its pacing, and the CAN port.

The only room of the simulator that uses the wall clock, asyncio and python-can.
"""
