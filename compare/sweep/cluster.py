"""A sweep on a Dask cluster that is already there (the extra ``[cluster]``)."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

# s until a scheduler has to answer
_PATIENCE = 10.0


@contextmanager
def executor_at(address: str) -> Iterator[Executor]:
    """An executor on the cluster whose scheduler has this address, as tcp://host:8786.

    A task that is lost with its worker goes again, twice.

    Raises
    ------
    ValueError
        If dask.distributed is not installed.
    OSError
        If no scheduler answers.
    """
    try:
        from distributed import Client
    except ImportError:
        raise ValueError("--dask needs dask.distributed: pip install 'ribbonfem[cluster]'") from None
    with Client(address, timeout=_PATIENCE) as client, client.get_executor(pure=False, retries=2) as executor:
        yield executor
