"""The protocols we run, a validated TOML file each, and their reader. The folder is the list."""

from sessions.protocols.protocol import BlockOutline, Face, Protocol, plan, protocol, protocol_names

__all__ = ["BlockOutline", "Face", "Protocol", "plan", "protocol", "protocol_names"]
