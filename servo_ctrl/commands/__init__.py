"""Commands to a running controller and its status: one declaration, and its encodings.

May enter: the declarations of commands and status fields, their encodings for SDO, MQTT, local socket and
command line, and transport of nothing else. `servo_ctrl.daemon.handlers` executes the commands.
"""
