"""How the page is served."""

from dataclasses import dataclass

from ..errors import InputError


@dataclass(frozen=True)
class Options:
    """How the page is served.

    Attributes:
        host: address that is listened at; this machine alone sees 127.0.0.1.
        port: number of the port to begin with; the next one that is free is taken.
        browser: whether a browser is opened.
    """

    host: str = "127.0.0.1"
    port: int = 8642
    browser: bool = True

    def __post_init__(self) -> None:
        if not 0 <= self.port <= 65535:
            raise InputError("a port is a number from 0 to 65535", key="port", value=self.port)
