"""Publishes status and rows and receives commands: MQTT and the local socket."""
