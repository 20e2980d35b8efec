"""Addresses "HOST:PORT" at which a tissue is served, and the sockets there."""

import ipaddress
import socket
from typing import Any

DEFAULT_HOST = "127.0.0.1"

DEFAULT_PORT = 8766

IDLE_SECONDS = 10
"""Silence after which the system probes the other one [s]."""

PROBE_SECONDS = 5
"""Time between two such questions [s]."""

N_PROBES = 3
"""Questions without an answer after which the connection is broken. So it takes 25 s, in which a
network may be out of order for a moment."""

_GONE_MILLISECONDS = 1000 * (IDLE_SECONDS + N_PROBES * PROBE_SECONDS)


def parse_address(address: str) -> tuple[str, int]:
    """Return host and port of "HOST:PORT", or of "[HOST]:PORT" where the host has colons.

    Raises:
        ValueError: the text is neither.
    """
    host, colon, port = address.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not colon or not host or not (port.isascii() and port.isdigit()) or int(port) > 65535:
        raise ValueError(f"{address!r} is not an address; wanted HOST:PORT, as in 127.0.0.1:8766")
    return host, int(port)


def format_address(address: tuple[Any, ...]) -> str:
    """Return "HOST:PORT" of a socket's address."""
    host, port = address[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def is_loopback(address: tuple[Any, ...]) -> bool:
    """Return whether a socket's address is on loopback, which no other machine can reach."""
    return ipaddress.ip_address(str(address[0]).partition("%")[0]).is_loopback


def bound_socket(host: str, port: int, *, has_key: bool) -> socket.socket:
    """Return a socket bound to an address, which must be on loopback unless there is a key.

    Raises:
        ValueError: the host does not exist, the port is out of range, or other machines can reach
            the host and there is no key.
        OSError: the port is in use or not allowed.
    """
    if not 0 <= port <= 65535:
        raise ValueError(f"port {port} does not exist; wanted 1 to 65535, or 0 for a free one")
    try:
        found = socket.getaddrinfo(host or "0.0.0.0", port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as cause:
        raise ValueError(f"there is no host {host!r}: {cause}") from cause
    if not has_key and not all(is_loopback(address) for *_, address in found):
        raise ValueError(
            f"{host!r} is open to other machines, and that takes a key: make one with "
            "`scalpel-sim key FILE`, and give the file here and on the other machine. Or "
            "listen on 127.0.0.1 and connect through an SSH tunnel"
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


def keep_alive(connection: socket.socket) -> None:
    """Enable probes that break a connection whose other end no longer answers.

    A process that is killed closes its connections. A machine that loses its power or its network
    does not, and without this its place would be taken for ever.
    """
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (
        ("TCP_KEEPIDLE", IDLE_SECONDS),
        ("TCP_KEEPALIVE", IDLE_SECONDS),  # its name on macOS
        ("TCP_KEEPINTVL", PROBE_SECONDS),
        ("TCP_KEEPCNT", N_PROBES),
        ("TCP_USER_TIMEOUT", _GONE_MILLISECONDS),  # for what was sent and is not acknowledged
    ):
        option = getattr(socket, name, None)
        if option is not None:
            connection.setsockopt(socket.IPPROTO_TCP, option, value)
