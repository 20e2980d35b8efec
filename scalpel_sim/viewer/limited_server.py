"""The HTTP server of the live page, with as many connections as browsers need and no more."""

from typing import Any

from tornado.httpserver import HTTPServer
from tornado.iostream import IOStream

MOST_CONNECTIONS = 64
"""Open connections at most. A browser opens up to six to a server."""

IDLE_SECONDS_OF_HTTP = 30.0
"""Time for a request to come, and for a connection to be idle before it is closed [s]. It does not
hold for a page's socket."""

LARGEST_HEAD = 1 << 14
"""Largest head of a request [byte]: browsers send a kilobyte."""

LARGEST_BODY = 1 << 10
"""Largest body of a request [byte]: there is none."""


class LimitedServer(HTTPServer):
    """Serves an application; connections beyond `MOST_CONNECTIONS` are closed at once."""

    def initialize(self, *args: Any, **options: Any) -> None:
        """Set the limits; called by tornado, whose constructor takes no notice of options."""
        limits = {
            "idle_connection_timeout": IDLE_SECONDS_OF_HTTP,
            "body_timeout": IDLE_SECONDS_OF_HTTP,
            "max_header_size": LARGEST_HEAD,
            "max_body_size": LARGEST_BODY,
        }
        super().initialize(*args, **(options | limits))
        self._streams: list[IOStream] = []

    def handle_stream(self, stream: IOStream, address: tuple[Any, ...]) -> None:
        """Handle a connection that was accepted."""
        self._streams = [each for each in self._streams if not each.closed()]
        if len(self._streams) >= MOST_CONNECTIONS:
            stream.close()
            return
        self._streams.append(stream)
        super().handle_stream(stream, address)
