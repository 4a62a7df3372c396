"""Sessions that hold all that an export has to carry, and their exports."""

import math
from dataclasses import replace

import numpy as np
from recordings import change, new_writer, readings
from simulated_session import Session
from stand_ins import INFO, ResumableClock

from sessions.exchange import ExportSource, export
from sessions.exchange.import_csv import import_csv
from sessions.recording import Recording
from sessions.recording.archive import seal
from sessions.recording.derived import set_gain_error
from sessions.recording.head import software_versions
from sessions.strokes import analyse
from sessions.strokes.decisions import Decision, append


def whole(folder):
    """Ten trials of a simulated subject, two readings lost."""
    Session(folder, lost=(700, 701)).run()
    seal(folder)


def torn(folder):
    """Nothing simulated, texts beyond ASCII, lost readings, a silence, odd numbers, a damaged block, and no end."""
    clock = ResumableClock()
    writer = new_writer(folder, info=replace(INFO, simulated=False), clock=clock)
    writer.event("take_started", 1, {"take": 1}, time_ns=50)
    for first, later, received in ((0, 0.0, 100), (110, 0.0, 200), (210, 30.0, 300), (310, 30.0, 400)):
        block = readings(first, 100, received_ns=received)
        raw = block.raw + 0.1
        raw[3] = [math.nan, 1e-7, -2.5e-13, -0.0, 5e-324, 1.7976931348623157e308]
        writer.readings(replace(block, raw=raw, time=block.time + later))
        writer.commit()
    writer.event("scored", 1, {"score": 42.5, "positions": [[1.25, 40.0], [1.5, 42.5]], "hand": "left"})
    writer.event("told", data={"sentence": 'tab\tline\nquote " äöü, 漢'})
    writer.close()
    change(folder, "UPDATE blocks SET crc32 = crc32 + 1 WHERE number = 4")


def scores_only(folder):
    """A visit without a transducer."""
    Session(folder, forces=False).run()


def foreign(folder):
    """A CSV file of somebody else's, without trials."""
    time = np.arange(400) / 100.0
    force = -np.interp(time, [0.0, 1.0, 1.5, 2.5, 3.0, 4.0], [0.0, 0.0, 2.0, 2.0, 0.0, 0.0])
    rows = [f"{t!r},{f / 2!r},0,{f!r},0,0,0" for t, f in zip(time.tolist(), force.tolist(), strict=True)]
    path = folder.with_suffix(".csv")
    path.write_text("\n".join(["t_s,Fx_N,Fy_N,Fz_N,Tx_Nm,Ty_Nm,Tz_Nm", *rows]))
    import_csv(path, folder)


MAKERS = {make.__name__: make for make in (whole, torn, scores_only, foreign)}


def source_of(name, folder):
    """Make one of these sessions in `folder` and return it as exports are given it; the whole one with a prediction."""
    MAKERS[name](folder)
    recording = Recording.open(folder)
    if name == "whole":
        append(recording, Decision("E02", "seen", "kept", 1, 1, None, new=True))
        set_gain_error(recording.folder, 0.003)
    analysis = {"made_by": software_versions(), **analyse(recording).to_dict()}
    prediction = {"trials": [{"trial": 1, "sed": 0.009, "stimulus": {"index": 80}, "solver": {"dofs": 9}}]}
    return ExportSource(recording, analysis, prediction if name == "whole" else None)


class Exports(dict):
    """Exports by format and session, written when first asked for."""

    def __init__(self, sources, room):
        self.sources, self.room = sources, room

    def __missing__(self, key):
        form, name = key
        self[key] = export(self.sources[name], form, self.room / f"{form}-{name}")
        return self[key]
