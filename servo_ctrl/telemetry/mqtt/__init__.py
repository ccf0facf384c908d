"""MQTT: client, topics, payloads, commands and the stream of rows."""
