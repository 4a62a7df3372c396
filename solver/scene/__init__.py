"""The scene: its tables and their checks, the published finger and its ten surfaces."""
