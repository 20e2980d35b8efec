"""Serves the tissue of the soak until it is killed."""

from functools import partial

from bridge import serve
from scalpel_sim.preparation.tissue import make_tissue
from tests.long.soak import SCENE

if __name__ == "__main__":
    serve(
        partial(make_tissue, SCENE),
        scene="soak",
        port=0,
        on_listening=partial(print, flush=True),
    )
