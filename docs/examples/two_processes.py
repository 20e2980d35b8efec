"""Hold the tissue in one process and the blade in another, as in the paper."""

import multiprocessing
from contextlib import closing
from multiprocessing.queues import Queue

import numpy as np

from bridge import Bridge, TcpLink, serve
from tissue import BladeSegment, Material, Tissue, block, fixed_nodes


def make_tissue() -> Tissue:
    """Return the body that each client gets."""
    mesh = block((3, 2, 2), (0.02, 0.02, 0.02))
    return Tissue(mesh, Material(toughness=5.0), fixed=fixed_nodes(mesh, "left,right"))


def hold_tissue(addresses: "Queue[str]") -> None:
    """Serve tissues at any free port of this machine, and say at which."""
    serve(make_tissue, scene="block", port=0, on_listening=addresses.put)


def main() -> None:
    """Cut from here a block that is there."""
    spawn = multiprocessing.get_context("spawn")
    addresses = spawn.Queue()
    server = spawn.Process(target=hold_tissue, args=(addresses,), daemon=True)
    server.start()
    with closing(TcpLink(addresses.get(timeout=120))) as link:
        bridge = Bridge(link)
        for y in np.arange(-0.002, 0.024, 6e-5):  # 60 mm/s
            tip, heel = np.array([0.009, y, -0.005]), np.array([0.009, y, 0.025])
            bridge.step(BladeSegment(tip, heel, np.array([0.0, 1.0, 0.0])), 1e-3)
        print(f"cut {bridge.result.cut_area * 1e6:.0f} mm2, {link.n_pieces()} pieces")
    server.terminate()
    server.join()


if __name__ == "__main__":
    main()
