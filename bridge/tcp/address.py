"""Where a tissue is served: "HOST:PORT", and whether other machines could listen in."""

import ipaddress
import socket
from typing import Any

DEFAULT_HOST = "127.0.0.1"
DEFAULT_PORT = 8766


def parse_address(address: str) -> tuple[str, int]:
    """Return host and port of "HOST:PORT", or of "[HOST]:PORT" where the host has colons.

    Raises:
        ValueError: it is neither.
    """
    host, colon, port = address.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not colon or not host or not (port.isascii() and port.isdigit()) or int(port) > 65535:
        raise ValueError(f"{address!r} is no address; wanted HOST:PORT, as in 127.0.0.1:8766")
    return host, int(port)


def name_of(address: tuple[Any, ...]) -> str:
    """Return "HOST:PORT" of a socket's address."""
    host, port = address[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def is_loopback(address: tuple[Any, ...]) -> bool:
    """Whether a socket's address is this machine's own, which no other machine can reach."""
    return ipaddress.ip_address(str(address[0]).partition("%")[0]).is_loopback


def bound(host: str, port: int, *, has_key: bool) -> socket.socket:
    """Return a socket bound to an address: of this machine alone, unless there is a key.

    Raises:
        ValueError: there is no such host, the port is none, or others can reach it without a key.
        OSError: the port is in use or not allowed.
    """
    if not 0 <= port <= 65535:
        raise ValueError(f"port {port} is none; wanted 1 to 65535, or 0 for any that is free")
    try:
        found = socket.getaddrinfo(host or "0.0.0.0", port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as cause:
        raise ValueError(f"there is no host {host!r}: {cause}") from cause
    if not has_key and not all(is_loopback(address) for *_, address in found):
        raise ValueError(
            f"{host!r} is open to other machines, and that takes a key: make one with "
            "`scalpel-sim key FILE`, and give it with --key FILE here and where the arm is. Or "
            "listen on 127.0.0.1, and reach it through an SSH tunnel"
        )
    family, kind, protocol, _, address = found[0]
    listener = socket.socket(family, kind, protocol)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
    except OSError:
        listener.close()
        raise
    return listener
