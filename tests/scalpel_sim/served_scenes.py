"""A scene whose tissue is served over TCP, and what of a run must then be the same."""

import threading
from contextlib import closing, contextmanager

from bridge import TcpLink
from bridge.tcp.server import TissueServer
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.scene.served import sent_views


def address_of_server(scene):
    """Serve the tissue of a scene in a thread of this process; return the address."""
    views = sent_views(scene.views)
    server = TissueServer(lambda: make_tissue(scene), scene=scene.name, views=views, port=0)
    threading.Thread(target=server.run, daemon=True).start()
    return server.address


@contextmanager
def served(scene):
    """Yield a link to the tissue of a scene, which a thread of this process serves."""
    with closing(TcpLink(address_of_server(scene))) as link:
        yield link
