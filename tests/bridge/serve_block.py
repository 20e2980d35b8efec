"""Serves a small block to cut, in a process of its own. Patience is short, for hostile clients."""

import sys

import bridge.server
from bridge.server import serve
from tissue.material import Material
from tissue.shapes import grid
from tissue.tissue import Tissue

SIDE = 0.02


def block() -> Tissue:
    """Return a block of 3 x 2 x 2 cells and 2 cm in length, held at its left and right sides."""
    mesh = grid((3, 2, 2), (SIDE, SIDE, SIDE))
    fixed = (mesh.positions[:, 0] == 0.0) | (mesh.positions[:, 0] == SIDE)
    return Tissue(mesh, Material(toughness=5.0), fixed=fixed)


if __name__ == "__main__":
    bridge.server.HANDSHAKE_SECONDS = 0.5
    bridge.server.FRAME_SECONDS = 0.5
    bridge.server.SEND_SECONDS = 0.5
    port = int(sys.argv[1]) if len(sys.argv) > 1 else 0
    serve(block, scene="block", port=port, on_listening=lambda address: print(address, flush=True))
