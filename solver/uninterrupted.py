"""Long work of a library, done so that Ctrl-C is heard all the while."""

import threading
from collections.abc import Callable


def beside(work: Callable[[], None]) -> None:
    """Do `work` in a thread of its own and wait for it; whatever it raises is raised here.

    Python delivers Ctrl-C to the main thread, between two steps of its own: in one long call of C it waits, and in a
    function that C calls it is printed and lost. A thread that only waits hears it at once. The work is then not
    broken off, only no longer waited for: it ends by itself, before the process does, which `os._exit` need not await.
    """
    if threading.current_thread() is not threading.main_thread():
        work()
        return
    raised: list[BaseException] = []
    done = threading.Event()

    def run() -> None:
        try:
            work()
        except BaseException as error:  # noqa: BLE001 - raised again where it is waited for
            raised.append(error)
        finally:
            done.set()

    threading.Thread(target=run, name="beside").start()
    while not done.wait(0.1):  # in parts, since Windows tells of Ctrl-C after a wait; join takes the thread for ended
        pass
    if raised:
        raise raised[0]
