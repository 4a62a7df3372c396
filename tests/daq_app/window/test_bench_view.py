"""The view of the bench: what the transducer, its readings and its zero are said to be."""

from dataclasses import replace

from msgspec import structs
from session_messages import (
    INFO,
    MOUNT,
    TOUCH,
    after,
    health_report,
    log,
)

from daq_app.recorder import messages as m
from daq_app.recorder.device_history import Life
from daq_app.window.state import (
    LifeKnown,
    Tick,
)
from daq_app.window.view import derive_view
from drivers.transducer import Health
from sessions.plan.plan import Frame


def test_no_reading_counts_as_of_now_once_the_recorder_is_dead_or_not_heard():
    state = after(Tick(100.0), *MOUNT, health_report((0.1,) * 7), Tick(101.0))
    assert not derive_view(state).bench.silent
    unheard = derive_view(after(Tick(105.0), state=state)).bench
    assert unheard.silent
    assert (unheard.lamp, unheard.lamp_text) == ("wrong", "no readings for 5 s")
    assert derive_view(after(m.Gone(False, "signal 9"), state=state)).bench.silent
    assert derive_view(after(m.Disconnect(), m.NoDevice(), state=state)).bench.silent


# ---- the bench


def test_the_health_lamp_names_what_was_lost():
    report = m.HealthReport(Health(received=7000, lost=3), 6998.0, (0.0,) * 7, (0.0,) * 7, 0)
    bench = derive_view(after(m.Device(INFO, None), report)).bench
    assert (bench.lamp, bench.lamp_text) == ("look", "3 lost")
    assert bench.rate == "6998 Hz (set 7000)"
    assert dict(bench.counters)["lost"] == "3"


def test_a_bench_that_is_not_being_read_has_a_dash_for_its_rate():
    report = m.HealthReport(Health(), 0.0, (0.0,) * 7, (0.0,) * 7, 0)
    assert derive_view(after(m.Device(INFO, None), report)).bench.rate == "– Hz (set 7000)"


def test_what_was_lost_and_a_rate_that_is_not_known_are_said_in_the_experimenters_language(monkeypatch):
    monkeypatch.setattr("daq_app.window.view_bench.tr", lambda text, **values: f"<{text.format(**values)}>")
    report = m.HealthReport(Health(received=7000, lost=3), 6998.0, (0.0,) * 7, (0.0,) * 7, 0)
    bench = derive_view(after(m.Device(replace(INFO, rate=float("nan")), None), report)).bench
    assert (bench.lamp_text, bench.rate) == ("3 <lost>", "<6998 Hz (set <unknown>)>")


def test_a_transducer_that_sends_nothing_for_a_second_is_said_to_while_it_may_still_come_back():
    def view_after(silence, *session):
        report = structs.replace(health_report((0.1,) * 7), silence=silence)
        return derive_view(after(m.Device(INFO, None), *session, report))

    quiet, silent = view_after(0.9, *TOUCH), view_after(2.2, *TOUCH)
    assert (quiet.bench.lamp, quiet.bench.silent, quiet.banner) == ("well", False, None)
    assert (silent.bench.lamp, silent.bench.lamp_text) == ("wrong", "no readings for 2 s")
    assert silent.bench.silent
    assert silent.banner.grade == "wrong"
    assert silent.banner.sentence.startswith("No readings for 2 s: check power and cable")
    assert derive_view(after(m.Device(INFO, None), m.LinkDown("the cable is out"))).bench.silent
    before = view_after(2.2)  # nothing is lost where nothing is recorded
    assert (before.bench.lamp, before.banner) == ("look", None)


def test_an_overload_stays_until_somebody_acknowledges_it():
    state = after(m.Device(INFO, None), health_report((0.1,) * 6 + (0.2,), (0.1, 0.1, 0.4, 0.1, 0.1, 0.9, 1.3)))
    bench = derive_view(state).bench
    [combined] = [bar for bar in bench.bars if bar.name == "combined"]
    assert (combined.share, combined.peak, combined.overloaded) == (0.2, 1.3, True)
    assert bench.can_acknowledge
    bench = derive_view(after(m.AcknowledgeOverloads(), state=state)).bench
    assert not bench.can_acknowledge
    assert bench.bars[-1].peak is None


def test_what_was_acknowledged_does_not_come_back_with_a_report_that_was_on_its_way():
    state = after(
        m.Device(INFO, None),
        health_report((1.4,) * 7),
        m.AcknowledgeOverloads(),
        health_report((1.4,) * 7),
        health_report((0.2,) * 7),
    )
    assert not derive_view(state).bench.can_acknowledge


def test_the_bench_tells_what_a_serial_number_has_been_through():
    life = Life(12, "2026-03-02", (0.041, 0, 0, 1.3, 0, 0), (0.0042,) * 3 + (0.052,) * 3, 2, "2026-10-01")
    state = after(m.Device(INFO, None), LifeKnown("another", None), LifeKnown(INFO.serial, life))
    rows = dict(derive_view(state).bench.life)
    assert rows["zeros"] == "12 since 2026-03-02"
    assert rows["noise"] == "4.2 mN, 0.052 N mm usually"
    assert rows["overloads"] == "2, the last on 2026-10-01"
    assert set(dict(derive_view(after(m.Device(INFO, None), state=state)).bench.life).values()) == {"–"}


def test_a_tare_shows_its_figures_in_newtons_and_how_far_the_zero_has_moved_since_the_first():
    first = m.Tared((8e3, -7e3, -1e3, 0.0, 0.0, 0.0), (4e3,) * 3 + (50.0,) * 3, 200, 1.0)
    bench = derive_view(after(m.Device(INFO, None), first)).bench
    assert bench.tare == "Fx 8, Fy −7, Fz −1 mN\nTx 0.0, Ty 0.0, Tz 0.0 N mm\nover 1.0 s, n = 200"
    assert bench.drift == "first zero"
    assert bench.bars[0].noise == "4.0 mN"
    assert bench.bars[3].noise == "0.050 N mm"
    second = log("zeroed", 1, mean=[14e3, -7e3, -1e3, 0.0, 0.0, 0.0], spread=[4e3] * 6, readings=100, duration=0.5)
    assert derive_view(after(m.Device(INFO, None), first, second)).bench.drift == "6 mN since the first"


def test_a_session_keeps_the_transducer_connected_and_its_zero_untouched_by_hand():
    bench = derive_view(after(*MOUNT)).bench
    assert bench.connect is None
    assert not bench.can_tare
    bench = derive_view(after(m.Device(INFO, None))).bench
    assert bench.connect == m.Disconnect()
    assert bench.can_tare


def test_a_simulated_bench_is_said_to_be_simulated_before_a_session_begins():
    assert derive_view(after(m.Device(replace(INFO, simulated=True), Frame()))).simulated is not None
    assert derive_view(after(m.Device(INFO, None))).simulated is None


# ---- the subject
