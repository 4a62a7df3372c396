"""A whole session in told time, with stand-ins for people and transducer."""

from stand_ins import INFO, Hands, StandIn, ToldClock

from sessions.protocols import plan, protocol
from sessions.recording import Recording, SessionWriter, provenance
from sessions.runner import run_session

PAPER = protocol("sensotact-friction")


class Session:
    """A session in told time, run when called."""

    def __init__(self, folder, *, forces=True, instead=None, **transducer):
        self.clock = ToldClock()
        self.plan = plan(PAPER, "S01", 3, forces=forces)
        info = INFO if forces else None
        self.writer = SessionWriter.create(
            folder, self.plan, info, provenance(self.clock), subject_simulated=True, clock=self.clock
        )
        self.transducer = StandIn(self.clock, **transducer) if forces else None
        self.hands = Hands(self.clock, self.transducer, instead)
        self.folder = folder

    def run(self, **options):
        self.end = run_session(self.plan, self.writer, self.hands, self.transducer, self.clock, **options)
        return Recording.open(self.folder)


def once(events):
    """Answer with `events` the first time, as usual afterwards."""
    left = [events]
    return lambda _: left.pop() if left else None
