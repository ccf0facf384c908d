"""What can be asked of a running controller and what it tells: one declaration, and its encodings.

May enter: the declarations of commands and status fields, their encodings for SDO, MQTT, local socket and
command line, and what carries nothing else. The handlers of the commands are in `servo_ctrl.daemon.handlers`.
"""
