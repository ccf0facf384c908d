"""The record of months, as far as its programs can be had: `make test-history` (Debian's InfluxDB)."""
