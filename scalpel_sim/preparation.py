"""From a scene to a simulation: body, stroke through it, and an arm that reaches."""

from collections.abc import Iterable

import numpy as np

from bridge import Fixture, InProcessLink, TissueFrame, TissueLink
from scalpel_sim.arm.collision_monitor import floor_below
from scalpel_sim.arm.placement import place
from scalpel_sim.scene_body import make_tissue
from scalpel_sim.scenes import Scene, read_stroke
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.planning import check_meets, plan
from tissue import TetrahedralMesh


def prepare(
    scene: Scene, link: TissueLink | None = None, fixtures: Iterable[Fixture] = ()
) -> Simulation:
    """Return the simulation of a scene, at its start.

    The stroke is planned on the body as it lies there, sagged and stretched: what the link says of
    it is all that is used, so that a body elsewhere gives the same run as one that is here.

    Args:
        scene: What to cut, and how.
        link: A body that is elsewhere already; None makes the scene's own in this process.
        fixtures: What stands around the body, in its frame: where that lies in the world is chosen
            here, so that the arm reaches.

    Raises:
        ValueError: the scene does not fit together; each part says how.
        LinkError: the body is elsewhere, and cannot be reached.
    """
    if link is None:
        link = InProcessLink(make_tissue(scene), scene.name)
    body = link.snapshot()
    mesh = TetrahedralMesh(body.positions, body.tetrahedra)
    stroke = read_stroke(scene) or plan(
        scene.stroke, mesh, speed=scene.speed, material=link.describe().material
    )
    check_meets(stroke, mesh)
    placement = place(stroke, link.describe().bounds, scene.arm)
    frame = TissueFrame(origin=placement.tissue_origin)
    tissue = link.describe()
    floor = [] if tissue.floor is None else [floor_below(tissue.bounds, tissue.floor)]
    world = TissueFrame(
        frame.rotation.T, frame.points_to_tissue(np.zeros(3))
    )  # as the tissue sees it
    standing = [world.fixture_to_tissue(fixture) for fixture in (*fixtures, *floor)]
    return Simulation(
        placement.arm(),
        stroke,
        link,
        frame,
        standing,
        tissue_every=scene.tissue_every,
        coupling=scene.virtual_coupling(),
        passivity=scene.passivity,
    )
