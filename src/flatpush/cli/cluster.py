"""Spreads work over the processes of a Dask cluster: a local one, or one that exists."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

from ..errors import FlatpushError, InputError, MissingExtra

A = TypeVar("A")
B = TypeVar("B")

PATIENCE = 8.0  # [s] for a scheduler to find workers
ANSWER = 1.0  # [s] for it to say who it is


def check_address(scheduler: str | None) -> None:
    """Refuses what cannot be the address of a scheduler, if one is given, before anything long is imported."""
    if scheduler is not None and not scheduler.rpartition(":")[2].rstrip("/").isdigit():
        raise _no_answer(scheduler, "no Dask scheduler answers where there is no port")


@contextmanager
def cluster(scheduler: str | None) -> Iterator["Mapper"]:
    """A function like map whose calls run on the workers of the scheduler at an address, or of a local cluster.

    Raises:
        MissingExtra: without dask.distributed.
        InputError: if no scheduler answers at the address within a few seconds.
    """
    check_address(scheduler)
    try:
        import distributed
    except ImportError:
        raise MissingExtra('a cluster needs dask.distributed: pip install "flatpush[cluster]"') from None
    import asyncio
    import logging

    import dask

    with dask.config.set(
        {"distributed.comm.timeouts.connect": PATIENCE, "distributed.logging.distributed": "critical"}
    ):
        if scheduler is None:
            with (
                distributed.LocalCluster(
                    processes=True,
                    threads_per_worker=1,
                    dashboard_address=None,
                    silence_logs=logging.CRITICAL,
                ) as local,
                distributed.Client(local) as client,
            ):
                yield Mapper(client)
            return
        try:
            asyncio.run(asyncio.wait_for(_ask(scheduler), ANSWER))
            client = distributed.Client(scheduler, timeout=PATIENCE, set_as_default=False)
        except (OSError, TimeoutError, ValueError, TypeError) as error:
            raise _no_answer(scheduler, f"no Dask scheduler answers within {ANSWER:.0f} s") from error
        with client:
            if not client.scheduler_info()["workers"]:
                try:
                    client.wait_for_workers(1, timeout=PATIENCE)
                except TimeoutError:
                    raise InputError(
                        "the scheduler has no workers",
                        key="--scheduler",
                        value=scheduler,
                        hint=f"Start some with: dask worker {scheduler}",
                    ) from None
            yield Mapper(client)


async def _ask(scheduler: str) -> None:
    """Asks a scheduler who it is. A Client would wait for minutes for what listens and is none.

    Raises:
        OSError, TimeoutError, ValueError: if there is none.
    """
    from distributed.comm import connect

    comm = await connect(scheduler, timeout=ANSWER)
    try:
        await comm.write({"op": "identity", "reply": True})
        answer = await comm.read()
    finally:
        comm.abort()
    if not isinstance(answer, dict) or answer.get("type") != "Scheduler":
        raise ValueError("what answers is no scheduler")


def _no_answer(scheduler: str, rule: str) -> InputError:
    hint = "Start one with: dask scheduler; its address looks like tcp://host:8786."
    return InputError(rule, key="--scheduler", value=scheduler, hint=hint)


class Mapper:
    """A function like map whose calls run on the workers of a cluster."""

    def __init__(self, client: Any) -> None:
        self._client = client

    def __call__(
        self, function: Callable[[A], B], jobs: Sequence[A], told: Callable[[B], None] | None = None
    ) -> list[B]:
        """The results in the order of the jobs; `told` is called with each as soon as it is there."""
        from distributed import as_completed

        futures = self._client.map(function, jobs, pure=False)
        try:
            if told is not None:
                for _, result in as_completed(futures, with_results=True):
                    told(result)
            return list(self._client.gather(futures))
        except FlatpushError:
            raise
        except Exception as error:
            raise FlatpushError(f"a worker failed: {type(error).__name__}: {error}") from error
        finally:
            self._client.cancel(futures)
