"""Processes of this machine that work for a caller, and end with its interest in them."""

import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context


@contextmanager
def processes(count: int) -> Iterator[ProcessPoolExecutor]:
    """So many processes; where the block ends, what runs in them still is ended and what waits is dropped.

    Ctrl-C, which reaches every process of a terminal, is left to the caller.
    """
    others = set(active_children())
    with ProcessPoolExecutor(
        count, get_context("spawn"), signal.signal, (signal.SIGINT, signal.SIG_IGN)
    ) as pool:
        try:
            yield pool
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in set(active_children()) - others:
                process.terminate()
