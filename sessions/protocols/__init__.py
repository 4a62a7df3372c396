"""The plans we run: one validated TOML file each, and their reader."""
