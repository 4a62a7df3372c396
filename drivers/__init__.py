"""From a device's bytes to readings."""
