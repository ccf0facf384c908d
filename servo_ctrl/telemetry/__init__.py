"""Status and rows to whoever listens: MQTT and the local socket."""
