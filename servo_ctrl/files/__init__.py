"""Files: read and written whole, private, in durable directories; Arrow and TOML behind one file each."""
