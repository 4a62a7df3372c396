"""The other end of the wire, and the other side of the glass."""
