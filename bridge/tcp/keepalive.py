"""Probes of the system that find out when the other machine, or the way to it, is gone."""

import socket

IDLE_SECONDS = 10
"""Silence after which the system asks the other one whether it is still there [s]."""
PROBE_SECONDS = 5
"""Time between two such questions [s]."""
N_PROBES = 3
"""Questions without an answer after which the connection is broken. So it takes 25 s, in which a
network may be out of order for a moment."""

_GONE_MILLISECONDS = 1000 * (IDLE_SECONDS + N_PROBES * PROBE_SECONDS)


def keep_alive(connection: socket.socket) -> None:
    """Have the system break a connection whose other end does not answer any more.

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
