"""From a scene to a simulation: the tissue, a stroke through it, and an arm that reaches."""

from collections.abc import Iterable

import numpy as np

from bridge import Fixture, InProcessLink, TissueFrame, TissueLink
from scalpel_sim.arm.collision_monitor import floor_below
from scalpel_sim.arm.placement import place
from scalpel_sim.scene_body import make_tissue
from scalpel_sim.scenes import Scene, read_stroke
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.planning import check_meets, plan_stroke
from tissue import TetrahedralMesh


def prepare(
    scene: Scene, link: TissueLink | None = None, fixtures: Iterable[Fixture] = ()
) -> Simulation:
    """Return the simulation of a scene, at its start.

    The stroke is planned on the body as it lies there, sagged and stretched. Only what the link
    describes is used, so that a body in another process gives the same run as one in this process.

    Args:
        scene: What to cut, and how.
        link: A body that is already there; None makes that of the scene in this process.
        fixtures: Rigid bodies around it, in the tissue frame: where that lies in the world is
            chosen here, so that the arm reaches.

    Raises:
        ValueError: parts of the scene do not fit together; the message says which.
        LinkError: the body is elsewhere, and cannot be reached.
    """
    if link is None:
        link = InProcessLink(make_tissue(scene), scene.name)
    body = link.snapshot()
    mesh = TetrahedralMesh(body.positions, body.tetrahedra)
    stroke = read_stroke(scene) or plan_stroke(
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
