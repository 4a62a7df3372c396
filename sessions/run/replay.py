"""Replay of a recorded session through the same machine, from its readings and the acts of people."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any

import msgspec

from drivers.clock import StillClock
from drivers.readings import ReadingBlock
from drivers.transducer import Health, LinkLost, TransducerInfo
from sessions.plan.plan import SessionPlan
from sessions.recording import Acknowledged, FleetingWriter, LoggedEvent, Recording, RecordingError
from sessions.recording.derived import differences
from sessions.recording.log import health_of
from sessions.recording.manifest import different, digest_of
from sessions.recording.reader import TELL_LOSSES
from sessions.recording.replay import RecordedReadings
from sessions.run.event_log import Step, parts, steps_of
from sessions.run.resuming import Seam, resumption
from sessions.run.runner import STOPPED_BY_USER, Continuation, Ending, RunnerSettings, run_session
from sessions.run.steps import Command, Event

SLICE = 0.02  # longest wait before a stop is noticed [s]
_PART = 16_384  # readings in one write
Progress = Callable[[float, str], None]  # part done (0 to 1), what is happening


class Stopped(Exception):
    """The replay was stopped before its end."""


def replay(recording: Recording, folder: Path, speed: float | None, progress: Progress) -> Recording:
    """Run a recorded session again into `folder`, `speed` times as fast as it was (None: as fast as possible).

    An imported recording has no session: its readings are copied without pauses, and its events written again. A
    resumed session is replayed part by part; where its readings were joined is taken from its log. Raises Stopped on
    Ctrl-C, RecordingError when nothing more can be written.
    """
    clock = _RecordedClock(recording)
    writer = _Rewriter.create(
        folder,
        recording.plan,
        recording.info,
        recording.provenance,
        subject_simulated="subject" in (recording.simulated_sentence or ""),
        clock=clock,
    )
    writer.follow(recording)
    if recording.plan.trials:
        _run(recording, clock, writer, speed, progress)
    else:
        _copy(recording, writer)
    return Recording.open(folder)


def different_events(first: Recording, second: Recording) -> Iterator[str]:
    """Yield a sentence for each event that differs, is new, or is missing."""
    log, replay_log = ([e for e in recording.events if e.kind not in TELL_LOSSES] for recording in (first, second))
    kinds, replay_kinds = ([(event.kind, event.trial) for event in events] for events in (log, replay_log))
    for operation, i, i_end, k, k_end in SequenceMatcher(None, kinds, replay_kinds, autojunk=False).get_opcodes():
        if operation == "equal":
            for old, new in zip(log[i:i_end], replay_log[k:k_end], strict=True):
                yield from differences(_plain(old), _plain(new), _name(old))
        else:
            yield from (f"{_name(event)} came no more" for event in log[i:i_end])
            yield from (f"{_name(event)} of the replay is new" for event in replay_log[k:k_end])


def different_readings(first: Recording, second: Recording) -> Iterator[str]:
    """Yield a sentence for each column of the readings that differs."""
    yield from different(digest_of(first.blocks(), ()), digest_of(second.blocks(), ()))


class _Rewriter(FleetingWriter):
    """Writes a replay: each event keeps its recorded instant.

    A recording that was cut short is cut short here too. Nothing waits for the disk: no data can be lost.
    """

    def follow(self, recording: Recording) -> None:
        self._later = [event for event in recording.events if event.kind in TELL_LOSSES]
        self._log: Sequence[LoggedEvent] = ()
        self._is_cut_short = False
        self._next_event = 0
        self._closing = False
        self.log_written: list[LoggedEvent] = []  # that was committed
        self.safe = self.log_written.extend

    def follow_part(self, log: Sequence[LoggedEvent]) -> None:
        """Take the instants from the log of a part, which may have been cut short."""
        super().commit()  # a part begins with all earlier data acknowledged
        self._log = log
        self._is_cut_short = not any(event.kind == "ended" for event in log)
        self._next_event = 0

    def instant_ns(self, kind: str, trial: int | None, /) -> int:
        """Return the instant of the next such event. Raises _CutShort where the recording stops without an end."""
        if self._is_cut_short and (kind == "ended" or self._next_event == len(self._log)):
            raise _CutShort("the recording was cut short here")
        following = range(self._next_event, len(self._log))
        position = next((i for i in following if (self._log[i].kind, self._log[i].trial) == (kind, trial)), None)
        if position is None:
            return super().instant_ns(kind, trial)
        self._next_event = position + 1
        return self._log[position].time_ns

    def commit(self) -> Acknowledged:
        """Write in large parts: nobody waits for an acknowledgement."""
        return super().commit() if self._closing or self.pending_count >= _PART else self.acknowledged

    def close(self) -> None:
        """Leave it open: a resumed part may follow."""

    def finish(self) -> None:
        """Write the events on a torn log, or on an incomplete restoration, and close."""
        self._closing = True
        self._is_cut_short, self._log = False, ()
        for event in self._later:
            self.event(event.kind, data=event.data)
        super().close()


class _CutShort(RecordingError):
    """The recording stops here, without an end."""


class _ReplayedError(Exception):
    """An error of the program that was recorded, raised again where it was raised."""


class _RecordedClock(StillClock):
    """The session clock of the recording: it shows the instant of the last step, and waiting takes no time."""

    def __init__(self, recording: Recording) -> None:
        super().__init__(recording.events[0].time_ns if recording.events else 0)
        self.factor = float(recording.provenance.get("clock", {}).get("factor", 1.0))

    def move(self, instant_ns: int) -> None:
        """Go on to an instant; never back."""
        self.at_ns = max(self.at_ns, instant_ns)


@dataclass(eq=False)
class _Player:
    """Plays transducer, experimenter and subject of a part of a recording. One cycle of the runner is one step.

    The part has the log `log` and the readings from the position of `readings` up to number `limit`.
    """

    transducer: TransducerInfo | None
    log: Sequence[LoggedEvent]
    readings: RecordedReadings
    limit: int | None
    clock: _RecordedClock
    settings: RunnerSettings
    speed: float | None  # of the recording's time; None: as fast as possible
    progress: Progress

    def __post_init__(self) -> None:
        self._steps = steps_of(self.log)
        self._first_ns = self.log[0].time_ns if self.log else 0
        self._began = time.monotonic()
        self._next = 0
        self._step: Step | None = None  # None while waiting for the next
        self._reported: list[LoggedEvent] = []
        self._said_ns: dict[str, int] = {}  # when losses, and a zero that cannot be measured, were last reported
        self._health: Health | None = None  # at the end
        self._stopped = False

    @property
    def at_end(self) -> bool:
        """Say whether the last step was taken."""
        return self._next == len(self._steps)

    def go_on(self) -> Ending | None:
        """Take the next step once it is due, and return why the session ends in it; None where it does not."""
        self._step = None
        if self.at_end:
            return "stopped", STOPPED_BY_USER  # the replay differs, and waits for an event that never comes
        step = self._steps[self._next]
        if self._wait_for(step):
            return None
        self._step = step
        self._next += 1
        self.progress(self._next / len(self._steps), "replaying")
        match step.end:
            case None | {"cause": "device" | "program"}:
                return None
            case {"cause": "client" | "disk" as cause, "reason": str(reason)}:
                return cause, reason
            case _:
                return "stopped", STOPPED_BY_USER

    # ---- as an operator

    def show(self, command: Command) -> None:
        """Ignore a command: the response to it is recorded."""

    def poll(self) -> Sequence[Event]:
        """Return the act of people in this step, if any."""
        step = self._step
        if step is None:
            return ()
        if step.end is not None and step.end.get("cause") == "program":
            name, _, message = str(step.end.get("reason", "")).partition(": ")
            raise type(name, (_ReplayedError,), {})(message)
        self.clock.move(step.instant_ns)
        return () if step.act is None else (step.act,)

    # ---- as a transducer

    @property
    def info(self) -> TransducerInfo:
        assert self.transducer is not None, "a visit without a transducer has none to ask"
        return self.transducer

    @property
    def health(self) -> Health:
        if self._health is not None:
            return self._health
        return replace(health_of(self._reported), received=self.readings.position)

    def start(self) -> None:
        """Begin."""

    def read(self, timeout: float) -> ReadingBlock:  # noqa: ARG002  never waits
        """Return the readings of this step; once stopped, all that remain."""
        step = self._step
        if self._stopped:
            return self.readings.up_to(self.limit)
        if step is None:
            return ReadingBlock.empty()
        if step.end is not None and step.end.get("cause") == "device":
            raise LinkLost(str(step.end.get("reason", "")))
        if step.losses is not None:
            self._reported.append(step.losses)
            self._move_past("losses", step, self.settings.losses_every)
        elif step.zero_missing:
            self._move_past("told", step, self.settings.zero_patience)
        elif step.act is None:
            self.clock.move(step.instant_ns)
        return self.readings.up_to(step.readings)

    def stop(self) -> None:
        """Stop; the health is then the recorded one, where the recording has an end."""
        self._stopped = True
        end = self._steps[-1].end
        if end:
            self._health = msgspec.convert(end.get("health", {}), Health)

    def close(self) -> None:
        """Release nothing."""

    def _wait_for(self, step: Step) -> bool:
        """Wait for a step, at most `SLICE` seconds, and say whether it is still not due."""
        if self.speed is None:
            return False
        due = self._began + (step.instant_ns - self._first_ns) * 1e-9 / self.speed
        remaining_s = due - time.monotonic()
        if remaining_s > 0.0:
            time.sleep(min(remaining_s, SLICE))
        return remaining_s > SLICE

    def _move_past(self, kind: str, step: Step, interval: float) -> None:
        """Move the clock to the step, and far enough after the last such report that the runner makes another."""
        last_ns = self._said_ns.get(kind)
        instant = step.instant_ns if last_ns is None else max(step.instant_ns, last_ns + round(interval * 1e9))
        self.clock.move(instant)
        self._said_ns[kind] = self.clock.now_ns()


_FORMER_RULES = {"sound_only": False, "keep_answered": False}


def recorded_settings(log: Sequence[LoggedEvent]) -> RunnerSettings:
    """Return the settings recorded in the log of a session or a part; the defaults where it has none.

    A recording without one of the later settings was made by the former rule.
    """
    for event in log:
        if event.kind in ("started", "resumed"):
            settings = event.data["settings"] if event.kind == "started" else event.data["run"]
            values = {name: setting["value"] for name, setting in settings.items()}
            return msgspec.convert(_FORMER_RULES | values, RunnerSettings)
    return RunnerSettings()


def _run(
    recording: Recording, clock: _RecordedClock, writer: _Rewriter, speed: float | None, progress: Progress
) -> None:
    """Let the runner conduct the session once more, part by part."""
    logs = parts([event for event in recording.events if event.kind not in TELL_LOSSES])
    readings = RecordedReadings(recording.blocks())
    try:
        for number, log in enumerate(logs):
            following_log = logs[number + 1] if number + 1 < len(logs) else None
            limit = None if following_log is None else following_log[0].readings

            def show(share: float, activity: str, number: int = number) -> None:
                progress((number + share) / len(logs), activity)

            player = _Player(recording.info, log, readings, limit, clock, recorded_settings(log), speed, show)
            writer.follow_part(log)
            continuation = None if number == 0 else _resume_part(recording.plan, writer.log_written, log)
            _run_part(recording.plan, player, writer, continuation)
    finally:
        writer.finish()


def _run_part(plan: SessionPlan, player: _Player, writer: _Rewriter, continuation: Continuation | None) -> None:
    transducer, settings = player if plan.forces else None, player.settings
    with suppress(_CutShort, _ReplayedError):  # these end a part
        end = run_session(plan, writer, player, transducer, settings=settings, resumed=continuation, stop=player.go_on)
        if end.cause == "stopped" and not player.at_end:
            raise Stopped


def _resume_part(plan: SessionPlan, earlier_events: Sequence[LoggedEvent], log: Sequence[LoggedEvent]) -> Continuation:
    """Return where a part of the session continues, after the parts that are replayed already."""
    resumption_data = next(event.data for event in log if event.kind == "resumed")
    seams = [event.data for event in log if event.kind == "readings_joined"]

    def seam_between(_last: ReadingBlock, _first: ReadingBlock) -> Seam:
        return _RecordedSeam(**seams[0]) if seams else _RecordedSeam(0, 0.0)

    data = {name: value for name, value in resumption_data.items() if name != "run"}
    place = resumption(plan, earlier_events, keep_answered=recorded_settings(log).keep_answered)
    return Continuation(place, data, ReadingBlock.empty(), seam_between)


@dataclass(frozen=True, slots=True)
class _RecordedSeam(Seam):
    """A seam in a recording, whose readings are continuous already."""

    def join(self, block: ReadingBlock) -> ReadingBlock:
        return block


def _copy(recording: Recording, writer: _Rewriter) -> None:
    """Copy the readings, and write each event at its position among them."""
    writer.follow_part([event for event in recording.events if event.kind not in TELL_LOSSES])
    readings = RecordedReadings(recording.blocks())
    for event in recording.events:
        if event.kind not in TELL_LOSSES:
            writer.readings(readings.up_to(event.readings))
            writer.event(event.kind, event.trial, event.data)
    writer.readings(readings.up_to(None))
    writer.finish()


def _name(event: LoggedEvent) -> str:
    trial_text = "" if event.trial is None else f" in trial {event.trial}"
    return f"event {event.number} ({event.kind}{trial_text})"


def _plain(event: LoggedEvent) -> dict[str, Any]:
    return {"time_ns": event.time_ns, "readings": event.readings, "data": event.data}
