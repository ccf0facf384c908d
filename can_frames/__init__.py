"""Sends and receives bursts of frames through a python-can bus, below the CAN ports of both sides.

May enter: the transport of frames through an interface. The ports interpret the frames.
"""
