"""What a server says of a request that fails, and that it goes on."""

import contextlib

import pytest

from bridge import LinkError
from tests.bridge.tcp.bare_sockets import link_once_free
from tests.bridge.tcp.test_places import server_in_a_thread
from tissue import TissueError

REASON = "TissueError: the motion became unstable"


def fail_twice(server, monkeypatch):
    """Ask a tissue that fails for what it cannot say, as a new client."""

    def fail():
        raise TissueError(REASON.partition(": ")[2])

    with contextlib.closing(link_once_free(server.address)) as link:
        monkeypatch.setattr(server._link, "n_pieces", fail)
        for _ in range(2):
            with pytest.raises(LinkError, match=REASON):
                link.n_pieces()


def test_why_requests_fail_is_logged_once_for_each_client(monkeypatch, caplog):
    with server_in_a_thread() as server:
        for _ in range(2):
            fail_twice(server, monkeypatch)
    errors = [each.getMessage() for each in caplog.records if each.levelname == "ERROR"]
    assert len(errors) == 2
    assert all(each.endswith(f" failed: {REASON}") for each in errors)
