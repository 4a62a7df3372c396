"""Faults that keep what was sent, for tests."""

from simulators.faults import Faults


class Ledger(Faults):
    """The timetable of one box, with every datagram that the box made and every one that left, in their order."""

    def __init__(self, timetable=(), **settings):
        super().__init__(timetable, **settings)
        self.datagrams, self.delivered = [], []

    def route(self, now, datagrams):
        """Return what leaves, and keep it."""
        batch = list(datagrams)
        self.datagrams += [datagram for _, datagram in batch]
        leaving = super().route(now, batch)
        self.delivered += leaving
        return leaving
