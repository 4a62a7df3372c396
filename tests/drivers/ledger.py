"""Faults that keep what was sent, for tests."""

from simulators.faults import Faults


class Ledger(Faults):
    """The timetable of one box, with every datagram that the box made and every one that left, in their order."""

    def __init__(self, timetable=(), **settings):
        super().__init__(timetable, **settings)
        self.datagrams, self.delivered = [], []

    def route(self, now, datagrams):
        """Return what leaves, and keep it."""
        made = list(datagrams)
        self.datagrams += [datagram for _, datagram in made]
        leaving = super().route(now, made)
        self.delivered += leaving
        return leaving
