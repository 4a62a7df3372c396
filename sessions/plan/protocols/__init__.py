"""The protocols we run, a validated TOML file each, their reader, and the plan of a session. The folder is the list."""
