"""The simulator's process: the bench of plant and nodes, its pacing, the CAN port, and the end by a signal.

The only room that knows the wall clock, asyncio and python-can.
"""
