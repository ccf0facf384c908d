"""Frames in bursts through a bus that python-can has opened: below the CAN ports of both sides.

May enter: how frames get through an interface. What they mean is a matter of the ports.
"""
