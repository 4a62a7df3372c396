"""Start of the program."""

import gc
import os
import signal
import sys


def main() -> None:
    """Run the command line, or without one open the window, and leave with the exit code."""
    answered = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if answered:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # until there is somebody to answer Ctrl-C with a sentence
    _open_streams()
    from daq_app.child_process import keep_current_folder_out, use_one_thread

    keep_current_folder_out()
    use_one_thread()
    first = sys.argv[1] if len(sys.argv) > 1 else "window"
    if first == "window" or first.startswith("--subject-"):
        from daq_app.qt.start import window  # the command line runs where Qt is not installed

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
    """Press Ctrl-C once more where it came while Python let go of an object, where no exception leaves."""
    if not issubclass(unraisable.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(unraisable)
        return
    import threading

    from daq_app.child_process import press_ctrl_c

    timer = threading.Timer(0.01, press_ctrl_c)  # at once, it would be raised in here, and end here too
    timer.daemon = True
    timer.start()


def _open_streams() -> None:
    """Open the null device in place of standard streams that are closed, so that no other file gets their number."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_RDWR), mode, encoding="utf-8"))


def _leave(code: int) -> None:
    """Leave with an exit code; at once where the user asked to stop and nothing is left to be ended."""
    from daq_app.console import STOPPED

    module = sys.modules.get("multiprocessing")  # which takes a while to import, and most verbs start none
    if code == STOPPED and not (module and module.active_children()):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)  # taking the loaded libraries apart first takes longer than Ctrl-C may
    gc.freeze()  # what is left goes with the process: to look for cycles in it first takes a tenth of a cold solve
    sys.exit(code)


if __name__ == "__main__":
    main()
