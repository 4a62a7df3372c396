"""What the live model costs: steps a second alone, and predictions a second and their age beside a 200 Hz stream.

Run: python -m benchmarks.live_model [--seconds 10] [--repeats 3]. No window: what is timed is from readings handed to
the model's client, which is asked 60 times a second as the window does, to a prediction in the client's hand.
"""

import argparse
import os
import statistics
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

RATE, FRAMES = 200, 60  # readings, and polls of the model, per second
MU, NORMAL = 0.6, 2.0


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    print(f"load of this computer: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    for kinematics in ("small", "finite"):
        _alone(kinematics, options.repeats)
    for _ in range(options.repeats):
        _with_readings(options.seconds)
    print(f"load of this computer: {os.getloadavg()[0]:.1f}")


def _forces(seconds: float, rate: int) -> tuple[np.ndarray, np.ndarray]:
    """Return time and wrench of a press with a slowly varying force, which slides towards +x from 0.6 s on."""
    time_s = np.arange(int(seconds * rate)) / rate
    normal = NORMAL * np.minimum(time_s / 0.3, 1.0) * (1.0 + 0.2 * np.sin(7.0 * time_s))
    wrench = np.zeros((len(time_s), 6))
    wrench[:, 0], wrench[:, 2] = MU * normal * np.clip((time_s - 0.3) / 0.3, 0.0, 1.0), -normal
    return time_s, wrench


def _alone(kinematics: str, repeats: int) -> None:
    from daq_app.window.live_follower import Follower
    from daq_app.window.live_model import Forces, Use

    follower = Follower(Use(None, kinematics))
    time_s, wrench = _forces(5.0, 200)
    for size, name in ((1, "one picture a step"), (4, "a picture every four steps")):
        times = []
        for _ in range(repeats):
            start = time.process_time()
            for i in range(0, len(time_s), size):
                batch = slice(i, i + size)
                follower.take(Forces(time_s[batch], -wrench[batch, 2], -wrench[batch, 0], 0, 1))
            times.append(time.process_time() - start)
        speed = f"{len(time_s) / statistics.median(times):.0f} steps a second of the processor"
        print(f"alone, {kinematics} strain, {name}: {speed}, median of {repeats}")


def _with_readings(seconds: float) -> None:
    from daq_app.recorder.messages import Live
    from daq_app.window.live_model_process import LiveModel
    from sessions.plan.plan import Frame

    model = LiveModel()
    model.prepare()
    while model.provisional is None and not model.problem:
        model.add(Live(0, *_block(0, 4), (0.0,) * 6), Frame("-z", "set", 20.0, "set"))
        model.poll()
        time.sleep(0.05)
    ages, sent, earlier = [], 0, model.predictions
    start = time.monotonic()
    while (now := time.monotonic() - start) < seconds:
        last = int(now * RATE)
        if last > sent:
            number, time_s, received, wrench, status = _block(sent, last)
            time_s = time_s.astype(np.float64)
            received = (1e9 * (start + time_s)).astype(np.int64)
            model.add(Live(1, number, time_s, received, wrench, status, (0.0,) * 6), Frame("-z", "set", 20.0, "set"))
            sent = last
        for prediction in model.poll():
            if prediction.stream == 1:
                ages.append(time.monotonic() - prediction.received_ns * 1e-9)
        time.sleep(1.0 / FRAMES)
    model.close()
    delay = f"{np.median(ages) * 1e3:.0f} ms at the median, {np.percentile(ages, 99) * 1e3:.0f} ms at 99 %"
    print(f"beside {RATE} Hz: {(model.predictions - earlier) / seconds:.0f} predictions a second, their age {delay}")


def _block(first: int, last: int) -> tuple[np.ndarray, ...]:
    time_s, wrench = _forces((last + 1) / RATE, RATE)
    number = np.arange(first, last)
    return number, time_s[number], number, wrench[number], np.zeros(last - first, np.int64)


if __name__ == "__main__":
    main()
