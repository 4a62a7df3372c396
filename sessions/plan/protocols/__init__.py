"""The built-in protocols (the TOML files of this folder), their reader, and the plan of a session."""
