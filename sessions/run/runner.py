"""Runs a session: carries out the machine's commands with a transducer, a writer and a clock, and feeds events back."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, Protocol

from drivers.clock import Clock
from drivers.readings import ReadingBlock
from drivers.transducer import COUNTS, DeviceFault, Health, LinkLost, SetupError, Transducer, flagged_words
from sessions.plan.plan import SessionPlan
from sessions.recording import Acknowledged, RecordingError, SessionWriter
from sessions.run.event_log import data_of, kind_of, line_of
from sessions.run.interruptions import Interruptions, interruptions
from sessions.run.live_detection import TakeWatch
from sessions.run.machine import advance, start, trial_in_hand
from sessions.run.resuming import Resumption, Seam
from sessions.run.states import Ended, OpenTake, Resting, Taring
from sessions.run.steps import Abort, AskRest, Command, Event, MeasureZero, Refuse, RestOver, Tell, UndoRedo
from sessions.strokes.settings import DetectorSettings

Cause = Literal["finished", "aborted", "stopped", "device", "client", "disk", "program"]
STOPPED_BY_USER = "stopped by the user"
Ending = tuple[Cause, str]  # why a session ends, for programs and for people


class Operator(Protocol):
    """Experimenter and subject, as the runner sees them: a terminal, a window, or a simulation. No call blocks."""

    def show(self, command: Command) -> None:
        """Take a command; `poll` later returns the event that answers it, if it asks for one."""

    def poll(self) -> Sequence[Event]:
        """Return what has happened since the last call, in order."""


@dataclass(frozen=True, slots=True)
class RunnerSettings:
    """How a session is run; written into its log."""

    tick: float = 0.02  # between two polls of transducer and operator [s, session clock]
    zero_duration: float = 0.5  # unloaded stretch before each take [s, device time]
    zero_patience: float = 5.0  # wait for a zero, before a message [s, session clock]
    after_lift: float = 0.5  # finger off, before a take ends [s, device time]
    losses_every: float = 1.0  # least time between two reports of lost readings [s, session clock]
    status_every: float = 0.1  # between two calls of `progress` [s, session clock]
    detection: DetectorSettings = field(default_factory=DetectorSettings)  # of the live detector, and of a quiet zero
    sound_only: bool = True  # readings with invalid values show neither zero nor contact
    keep_answered: bool = True  # an end of the session keeps a take whose stroke and answer are done


@dataclass(frozen=True, slots=True)
class Continuation:
    """Where a session that was cut short continues, and the readings before it."""

    resumption: Resumption
    data: Mapping[str, Any]  # of the event `resumed`
    last_block: ReadingBlock  # the last readings before; empty where there were none
    seam_between: Callable[[ReadingBlock, ReadingBlock], Seam] = Seam.between  # last readings before and first after it


@dataclass(frozen=True, slots=True)
class Status:
    """Progress of a running session, for display."""

    state: str  # name of the machine's state
    trial: int | None  # number of the trial in hand
    trials: int  # in the plan
    readings: int  # handed to the recording
    lost: int  # readings that never arrived
    lag_ms: float  # age of the newest reading when it was handed over
    safe: Acknowledged  # readings acknowledged by the recording


@dataclass(frozen=True, slots=True)
class SessionEnd:
    """How a session ended; also written to its log."""

    reason: str
    cause: Cause
    complete: bool  # True when every trial was done or skipped
    readings: int
    health: Health


def run_session(
    plan: SessionPlan,
    writer: SessionWriter,
    operator: Operator,
    transducer: Transducer | None,
    *,
    settings: RunnerSettings | None = None,
    resumed: Continuation | None = None,
    stop: Callable[[], Ending | None] = lambda: None,
    progress: Callable[[Status], None] = lambda _: None,
) -> SessionEnd:
    """Run the session to its end on the writer's clock, record all of it, and close the writer.

    The session ends with the machine, when `stop` returns a reason, on Ctrl-C, and when the transducer is lost; its log
    then names the reason. With `resumed` an interrupted session continues. The transducer is started and stopped, not
    closed. Raises RecordingError when writing fails; any other error of the program is raised again after the end was
    written.
    """
    if plan.forces != (transducer is not None):
        raise ValueError("a visit with forces needs a transducer, and one without has none")
    with interruptions() as interruption:
        run = _Run(plan, writer, operator, transducer, writer.clock, settings or RunnerSettings(), progress, resumed)
        return run.to_the_end(interruption, stop)


@dataclass(eq=False)
class _Run:
    """The mutable state of a running session."""

    plan: SessionPlan
    writer: SessionWriter
    operator: Operator
    transducer: Transducer | None
    clock: Clock
    settings: RunnerSettings
    progress: Callable[[Status], None]
    resumed: Continuation | None

    def __post_init__(self) -> None:
        resumption = None if self.resumed is None else self.resumed.resumption
        begin = start(self.plan) if resumption is None else (resumption.state, resumption.commands)
        self._state, self._first_commands = begin
        self._watch: TakeWatch | None = None
        self._seam: Seam | None = None
        self._reported = Health()
        self._due_ns: dict[str, int] = dict.fromkeys(("losses", "status", "zero"), self.clock.now_ns())
        self._rested_ns: int | None = None  # when the rest is over [session clock]

    def to_the_end(self, interruption: Interruptions, stop: Callable[[], Ending | None]) -> SessionEnd:
        """Run, and write the end, except where the recording itself fails."""
        try:
            self._write_beginning()
            if self.transducer is not None:
                with interruption.raise_at_once():  # a device may answer late
                    self.transducer.start()
            cause, reason = self._go_round(lambda: ("stopped", STOPPED_BY_USER) if interruption.pending else stop())
        except (LinkLost, DeviceFault, SetupError) as error:
            cause, reason = "device", str(error)
        except KeyboardInterrupt:
            cause, reason = "stopped", STOPPED_BY_USER
        except RecordingError:
            if self.transducer is not None:
                self.transducer.stop()
            self.writer.close()
            raise
        except BaseException as error:
            self._end("program", f"{type(error).__name__}: {error}")
            raise
        return self._end(cause, reason)

    def _write_beginning(self) -> None:
        """Write the settings; for a resumed session also the gap and the fate of the open take."""
        settings = {"settings": _with_origin(self.settings)}
        if self.resumed is None:
            self.writer.event("started", data=settings)
            return
        for line in self.resumed.resumption.due_lines:
            self.writer.event(*line, commit=False)
        self.writer.event("resumed", data={**self.resumed.data, "run": settings["settings"]})

    def _go_round(self, stop: Callable[[], Ending | None]) -> Ending:
        """Poll transducer and operator until there is a reason to end."""
        self._carry_out(self._first_commands)
        while True:
            began_ns = self.clock.now_ns()
            if (ending := stop()) is not None:
                return ending
            if self.writer.must_end is not None:
                return "disk", self.writer.must_end
            self._listen()
            rest_over = self._rested_ns is not None and self.clock.now_ns() >= self._rested_ns
            if rest_over and isinstance(self._state, Resting):
                self._take(RestOver())
            for event in self.operator.poll():
                self._take(event)
            if isinstance(self._state, Ended):
                return ("finished" if self._state.complete else "aborted"), self._state.reason
            self._tell_status()
            self.clock.sleep(max(self.settings.tick - (self.clock.now_ns() - began_ns) * 1e-9, 0.0))

    def _listen(self) -> None:
        """Record the transducer's readings, and pass the events detected in them to the machine."""
        if self.transducer is None:
            self.writer.readings(ReadingBlock.empty())  # the disk is still checked every second
            return
        block = self._going_on(self.transducer.read(self.settings.tick))
        self.writer.readings(block)
        if self._watch is not None:
            for event in self._watch.feed(block):
                self._take(event)
        if isinstance(self._state, Taring) and self._due("zero", self.settings.zero_patience):
            assert self._watch is not None, "a zero that is measured has a watch"
            zero_missing = Tell(self._watch.zero_obstacle)
            self.writer.event("told", trial_in_hand(self._state), {"sentence": zero_missing.sentence})
            self.operator.show(zero_missing)
        self._report_losses()

    def _going_on(self, block: ReadingBlock) -> ReadingBlock:
        """Return readings with numbers and times that continue those before a resumption."""
        if self.resumed is None or not len(block):
            return block
        if self._seam is None:
            self._seam = self.resumed.seam_between(self.resumed.last_block, block)
            self.writer.event("readings_joined", data=asdict(self._seam), commit=False)
        return self._seam.join(block)

    def _take(self, event: Event) -> None:
        """Pass an event to the machine, write event and commands, then carry the commands out."""
        previous, kind = self._state, kind_of(type(event))
        self._state, commands = advance(previous, event, keep_answered=self.settings.keep_answered)
        refusals = [command for command in commands if isinstance(command, Refuse)]
        if refusals:
            data = {"event": kind, "sentence": refusals[0].sentence, "given": data_of(event)}
            self.writer.event("refused", trial_in_hand(previous), data)
            self.operator.show(refusals[0])
            return
        entry = self.writer.event(kind, trial_in_hand(previous), data_of(event), commit=False)
        for command in commands:
            if isinstance(command, AskRest):  # counted from its event, whose instant a replay knows
                self._rested_ns = None if command.duration is None else entry.time_ns + round(command.duration * 1e9)
        if isinstance(event, UndoRedo) or not isinstance(self._state, OpenTake):
            self._watch = None
        self._carry_out(commands)

    def _carry_out(self, commands: Sequence[Command]) -> None:
        """Write and commit commands before anybody sees them."""
        self._write(commands)
        self.writer.commit()
        for command in commands:
            if isinstance(command, MeasureZero):
                self._begin_watch()
            self.operator.show(command)
        self._due_ns["status"] = self.clock.now_ns()

    def _write(self, commands: Sequence[Command]) -> None:
        for line in filter(None, map(line_of, commands)):
            self.writer.event(*line, commit=False)

    def _begin_watch(self) -> None:
        assert self.transducer is not None, "a zero is measured only where there is a transducer"
        settings, info, frame = self.settings, self.transducer.info, self.plan.frame
        self._watch = TakeWatch(
            info, frame, settings.zero_duration, settings.detection, settings.after_lift, settings.sound_only
        )
        self._due_ns["zero"] = self.clock.now_ns() + round(settings.zero_patience * 1e9)

    def _report_losses(self, *, immediately: bool = False) -> None:
        """Log the readings that the driver lost, repeated or flagged since the last report."""
        if self.transducer is None:
            return
        health = self.transducer.health
        counts = {name: getattr(health, name) - getattr(self._reported, name) for name in COUNTS}
        if any(counts.values()) and (immediately or self._due("losses", self.settings.losses_every)):
            summary = ", ".join(f"{count} {name}" for name, count in counts.items() if count)
            reported_flags = self._reported.flagged
            flags = dict(Counter(health.flagged) - Counter(reported_flags))
            causes = [health.rate_words] if counts["off_rate"] else []
            causes += [f"status: {flagged_words(flags)}"] if flags else []
            sentence = f"readings: {summary}" + (f" ({'; '.join(causes)})" if causes else "")
            data: dict[str, Any] = {**counts, "rate_words": health.rate_words} if counts["off_rate"] else {**counts}
            data |= {"flagged": flags} if flags else {}
            self.writer.event("losses", trial_in_hand(self._state), {**data, "sentence": sentence})
            self._reported = health

    def _due(self, name: str, interval: float) -> bool:
        """Say whether a timer is due; if so, set its next time."""
        now_ns = self.clock.now_ns()
        if now_ns < self._due_ns[name]:
            return False
        self._due_ns[name] = now_ns + round(interval * 1e9)
        return True

    def _tell_status(self) -> None:
        if not self._due("status", self.settings.status_every):
            return
        health = self.transducer.health if self.transducer is not None else Health()
        self.progress(
            Status(
                type(self._state).__name__.lower(),
                trial_in_hand(self._state),
                len(self.plan.trials),
                self.writer.reading_count,
                health.lost,
                health.lag_ms,
                self.writer.acknowledged,
            )
        )

    def _end(self, cause: Cause, reason: str) -> SessionEnd:
        """Stop the stream, record its last readings, write the end, and close the writer in any case."""
        with closing(self.writer):
            health = self._last_readings()
            if not isinstance(self._state, Ended):
                self._state, commands = advance(self._state, Abort(reason), keep_answered=self.settings.keep_answered)
                self._write(commands)
            complete = isinstance(self._state, Ended) and self._state.complete
            self._report_losses(immediately=True)
            end = SessionEnd(reason, cause, complete, self.writer.reading_count, health)
            self.writer.event("ended", data=asdict(end))
        return end

    def _last_readings(self) -> Health:
        if self.transducer is None:
            return Health()
        self.transducer.stop()
        with suppress(LinkLost, DeviceFault):  # raised only after all readings that arrived were handed over
            while len(block := self._going_on(self.transducer.read(0.0))):
                self.writer.readings(block)
        return self.transducer.health


def _with_origin(settings: RunnerSettings) -> dict[str, Any]:
    """Return the settings as plain data, each marked as set or as the default."""
    default = asdict(RunnerSettings())
    return {
        name: {"value": value, "origin": "default" if value == default[name] else "set"}
        for name, value in asdict(settings).items()
    }
