"""Surfaces as users have them: good, bad and hopeless. Sizes are in metres."""

import numpy as np
import trimesh


def ball(radius=0.05, fineness=2):
    return trimesh.creation.icosphere(fineness, radius)


def box(sides=(0.06, 0.05, 0.04)):
    return trimesh.creation.box(sides).subdivide().subdivide()


def of(vertices, faces):
    return trimesh.Trimesh(vertices, faces, process=False)


def both(*meshes):
    return trimesh.util.concatenate(meshes)


def moved(mesh, way):
    copy = mesh.copy()
    copy.apply_translation(way)
    return copy


def hollow():
    inner = ball(0.03)
    inner.invert()
    return both(ball(), inner)


def pressed_flat():
    """A ball pressed to a disc whose rim is a cusp, of which a mesher rounds more than it says."""
    mesh = ball(fineness=3)
    share = mesh.vertices[:, 2] / 0.05
    mesh.vertices[:, 2] = 0.01 * np.sign(share) * share**2
    return mesh


def inside_out():
    mesh = ball()
    mesh.invert()
    return mesh


def facing_either_way(seed=0):
    mesh = ball()
    faces = mesh.faces.copy()
    turned = np.random.default_rng(seed).random(len(faces)) < 0.3
    faces[turned] = faces[turned][:, ::-1]
    return of(mesh.vertices, faces)


def noisy(mesh, way, seed=0):
    random = np.random.default_rng(seed)
    return of(mesh.vertices + random.normal(0.0, way, mesh.vertices.shape), mesh.faces)


def soup(seed=0):
    return of(np.random.default_rng(seed).random((90, 3)) * 0.1, np.arange(90).reshape(-1, 3))


def sheet():
    grid = np.indices((9, 9)).reshape(2, -1).T * 0.01
    corner = np.arange(81).reshape(9, 9)[:-1, :-1].ravel()
    quads = corner[:, None] + [0, 1, 10, 9]
    return of(np.c_[grid, np.zeros(81)], np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]))


def moebius(n=60):
    angle = np.repeat(np.linspace(0.0, 2.0 * np.pi, n, endpoint=False), 2)
    across = np.tile([-0.01, 0.01], n)
    radius = 0.05 + across * np.cos(angle / 2)
    at = [radius * np.cos(angle), radius * np.sin(angle), across * np.sin(angle / 2)]
    pairs = np.arange(2 * n).reshape(n, 2)
    after = np.roll(pairs, -1, axis=0)
    after[-1] = [1, 0]
    strips = np.c_[pairs, after]
    return of(np.transpose(at), np.concatenate([strips[:, [0, 2, 1]], strips[:, [1, 2, 3]]]))


def with_a_fin():
    mesh = ball()
    faces = np.vstack([mesh.faces, [[0, 1, len(mesh.vertices)]]])
    return of(np.vstack([mesh.vertices, [[0.1, 0.0, 0.0]]]), faces)


FILLED = {
    "box without a lid": lambda: of(
        box().vertices, box().faces[box().triangles_center[:, 2] < 0.0199]
    ),
    "small hole": lambda: of(ball().vertices, ball().faces[3:]),
    "inside out": inside_out,
    "facing either way": facing_either_way,
    "overlapping": lambda: both(ball(), moved(ball(), (0.05, 0.0, 0.0))),
    "touching in an edge": lambda: both(box(), moved(box(), (0.06, 0.05, 0.0))),
    "triangles twice": lambda: of(ball().vertices, np.vstack([ball().faces] * 2)),
    "flat triangles": lambda: of(
        ball().vertices, np.vstack([ball().faces, ball().faces[:50][:, [0, 0, 1]]])
    ),
    "noisy": lambda: noisy(ball(), 0.001),
    "hollow": hollow,
    "thin": lambda: trimesh.creation.box((0.05, 0.05, 0.002)),
    "with a fin": with_a_fin,
}
"""Bad surfaces that enclose a body all the same."""

REFUSED = {
    "separate triangles": (soup, "form no closed surface"),
    "one triangle": (lambda: of(ball().vertices, ball().faces[:1]), "form no closed surface"),
    "sheet": (sheet, "the surface is open"),
    "double sheet": (
        lambda: both(sheet(), of(sheet().vertices, sheet().faces[:, ::-1])),
        "is open",
    ),
    "Moebius strip": (moebius, "form no closed surface"),
    "in one line": (lambda: of([[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]], [[0, 1, 2]]), "in one line"),
    "thin as a film": (lambda: trimesh.creation.box((0.1, 0.1, 1e-6)), "is a sheet, 141 mm wide"),
    "in millimetres": (lambda: ball(50.0), "add --scale 0.001, which makes it 100 mm wide"),
    "in kilometres": (lambda: ball(1e-7), "Add --scale"),
}
"""Surfaces that enclose no body, and what is said of them."""

KINDS = ("thin", "hollow", "touching", "open", "noisy", "huge", "tiny", "bumpy")


def of_a_kind(seed):
    """A random surface of one kind, the kind, and how many metres its unit is."""
    random = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    mesh = ball(0.05, int(random.integers(2, 4)))
    mesh.vertices *= random.uniform(0.5, 1.5, 3)
    if kind == "thin":
        mesh = trimesh.creation.box([0.06, 0.04, 10.0 ** random.uniform(-3.0, -2.3)])
    elif kind == "hollow":
        inner = mesh.copy()
        inner.vertices *= random.uniform(0.3, 0.9)
        mesh = both(mesh, inner)
    elif kind == "touching":
        mesh = both(
            mesh, moved(mesh, [random.uniform(0.8, 1.0) * np.ptp(mesh.vertices[:, 0]), 0, 0])
        )
    elif kind == "open":
        height = random.uniform(-0.2, 0.9) * mesh.vertices[:, 2].max()
        mesh = of(mesh.vertices, mesh.faces[mesh.triangles_center[:, 2] < height])
    elif kind == "noisy":
        mesh = noisy(mesh, 10.0 ** random.uniform(-4.0, -2.5), seed)
    elif kind == "bumpy":
        waves = np.sin(mesh.vertices @ random.normal(0.0, 100.0, (3, 3))).sum(axis=1)
        mesh = of(mesh.vertices * (1.0 + 0.1 * waves[:, None]), mesh.faces)
    unit = {"huge": 1e-6, "tiny": 1e3}.get(kind, 1.0)
    return of(mesh.vertices / unit, mesh.faces), kind, unit
