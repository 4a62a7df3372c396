"""What a link to a device is, whatever it runs over."""

from typing import Protocol


class Link(Protocol):
    """A way to one device."""

    def send(self, data: bytes) -> None:
        """Send `data`. Raises LinkLost when the link is gone for good."""
        ...

    def receive(self, timeout: float) -> bytes | None:
        """Return what arrived next, or None when nothing came within `timeout` real seconds."""
        ...

    def close(self) -> None:
        """Give the port back. Harmless when repeated."""
        ...
