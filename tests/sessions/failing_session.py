"""A session in simulated time on a disk that fails, and ways to fail."""

from faulty_disk import FULL, IOERR_WRITE, OK, faulty_disk
from stand_ins import INFO, Hands, ResumableClock, StandIn

from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol
from sessions.recording import Recording, RecordingError, SessionWriter, provenance
from sessions.recording.schema import event_row
from sessions.run.resuming import check_resumable, resumption
from sessions.run.runner import run_session

PLAN = plan(protocol("sensotact-friction"), "S01", 3)
RESERVE = 2**20


class OnADisk:
    """A session in simulated time on a disk that fails as `fail` says; `acknowledged` is what it last called safe."""

    def __init__(self, folder, fail):
        self.folder = folder
        self.end = self.error = None
        self.safe_events = []
        self.acknowledged = 0
        clock = ResumableClock()
        with faulty_disk(fail) as disk:
            try:
                writer = SessionWriter.create(folder, PLAN, INFO, provenance(clock), clock=clock, reserve=RESERVE)
                writer.safe = self.safe_events.extend
                device = StandIn(clock)
                self.end = run_session(
                    PLAN, writer, Hands(clock, device), device, progress=lambda status: self.acknowledge(status)
                )
            except RecordingError as error:
                self.error = str(error)
            self.calls = disk.calls

    def acknowledge(self, status):
        self.acknowledged = status.safe.readings

    def check(self):
        """Check that nothing acknowledged is lost and that the session goes on where it was."""
        try:
            recording = Recording.open(self.folder)
        except RecordingError:
            assert self.safe_events == []
            assert self.error is not None
            return None
        assert list(map(event_row, recording.events[: len(self.safe_events)])) == list(map(event_row, self.safe_events))
        sequence = recording.readings().sequence.tolist()
        assert sequence == list(range(len(sequence)))
        assert len(sequence) >= self.acknowledged
        if recording.end is None or not recording.end["complete"]:
            check_resumable(recording)
            kept_trials = {event.trial for event in recording.events if event.kind == "take_kept"}
            commands = resumption(recording.plan, recording.events).commands
            trial_numbers = [command.trial.number for command in commands if hasattr(command, "trial")]
            assert trial_numbers in ([len(kept_trials) + 1], [])
        return recording


def failing_once(number, code=IOERR_WRITE):
    return lambda _what, call, _arguments: code if call == number else OK


def failing_from(number, code=FULL):
    return lambda _what, call, _arguments: code if call >= number else OK


class Quota:
    """So many bytes may be written in all, and as many more as the reserve holds once that is given back."""

    def __init__(self, folder, size):
        self.folder, self.size, self.ends = folder, size, {}

    def __call__(self, what, _call, arguments):
        if what != "write":
            return OK
        file, _, length, offset = arguments
        file_ends = {**self.ends, file: max(self.ends.get(file, 0), offset + length)}
        reserve = self.folder / "session.reserve"
        if sum(file_ends.values()) > self.size + RESERVE - (reserve.stat().st_size if reserve.exists() else 0):
            return FULL
        self.ends = file_ends
        return OK
