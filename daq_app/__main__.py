"""Entry point of the program."""

import atexit
import gc
import os
import signal
import sys


def main() -> None:
    """Run the command line, or open the window if there are no arguments, and exit with its code."""
    answered = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if answered:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # until the program can answer Ctrl-C with a message
    _open_streams()
    atexit.register(_flush_streams)
    from daq_app.child_process import keep_current_folder_out, use_one_thread

    keep_current_folder_out()
    use_one_thread()
    first = sys.argv[1] if len(sys.argv) > 1 else "window"
    if first == "window" or first.startswith("--subject-"):
        from daq_app.qt.start import window  # the command line works without Qt

        sys.exit(window(sys.argv[1 + (first == "window") :]))
    from daq_app.cli.main import run

    if answered:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.unraisablehook = _repeat_stop
    code = run(sys.argv[1:])
    if answered:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    _leave(code)


def _repeat_stop(unraisable: "sys.UnraisableHookArgs") -> None:
    """Repeat a Ctrl-C that arrived in a finaliser, from which no exception propagates."""
    if not issubclass(unraisable.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(unraisable)
        return
    import threading

    from daq_app.child_process import press_ctrl_c

    timer = threading.Timer(0.01, press_ctrl_c)  # raised immediately, it would be lost in here too
    timer.daemon = True
    timer.start()


def _open_streams() -> None:
    """Open the null device in place of closed standard streams, so that no other file gets their descriptors."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_RDWR), mode, encoding="utf-8"))


def _flush_streams() -> None:
    """Write what the standard streams hold. What they refuse was reported, and must not change the exit code."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _leave(code: int) -> None:
    """Exit with a code; immediately if the user stopped the program and no child process is left."""
    from daq_app.console import STOPPED

    module = sys.modules.get("multiprocessing")  # slow to import, and most verbs start no process
    if code == STOPPED and not (module and module.active_children()):
        _flush_streams()
        os._exit(code)  # finalising the loaded libraries takes longer than Ctrl-C may
    gc.freeze()  # skips the last garbage collection, which takes a tenth of a cold solve
    sys.exit(code)


if __name__ == "__main__":
    main()
