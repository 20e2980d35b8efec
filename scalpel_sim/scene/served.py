"""A scene around a body in another process, and the views that its server sends."""

from collections.abc import Sequence

from msgspec import ValidationError, convert

from bridge import LinkError, SceneView, TissueLink, sent_scene_name
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.body import GivenBody
from scalpel_sim.scene.checks import check_rows, check_view
from scalpel_sim.scene.read import SCENES, TASK_SCENES, scene_called
from scalpel_sim.scene.scene import Scene, changed
from scalpel_sim.scene.schema import ViewTable
from tissue import TetrahedralMesh


def scene_of(link: TissueLink, scene: Scene | None = None) -> Scene:
    """Return a scene around a body that already exists.

    Args:
        link: To the body.
        scene: What is done with it; None: what the scene of its name does, if that comes with the
            project, seen as the server says.

    Raises:
        LinkError: the body is in another process, and cannot be reached.
        UsageError: the body is that of another scene.
    """
    body = link.describe()
    if scene is not None:
        if body.scene not in (scene.name, sent_scene_name(scene.name)):
            raise UsageError(f"the body there is that of '{body.scene}', not of '{scene.name}'")
        return changed(scene, material=body.material)
    views = received_views(body.views)
    if body.scene in (*SCENES, *TASK_SCENES):
        return changed(scene_called(body.scene), material=body.material, views=views)
    rest = link.snapshot()
    labels = rest.labels if rest.labels.any() else None
    mesh = TetrahedralMesh(rest.rest_positions, rest.tetrahedra, labels, link.label_names)
    about = f"the body '{body.scene}'"
    found = Scene(name=body.scene, about=about, body=GivenBody(source=lambda: mesh), views=views)
    return changed(found, material=body.material)


def sent_views(views: Sequence[ViewTable]) -> tuple[SceneView, ...]:
    """Return the views of a scene as a server of its tissue sends them."""
    return tuple(
        SceneView(view.name, view.eye, view.target, view.up, view.fov_degrees) for view in views
    )


def received_views(views: Sequence[SceneView]) -> tuple[ViewTable, ...]:
    """Return the views that a server has sent.

    Raises:
        LinkError: one of them shows nothing, or has no name that a page can show.
    """
    try:
        tables = tuple(convert(view._asdict(), ViewTable) for view in views)
        check_rows("view", tables, check_view)
    except (ValidationError, UsageError) as error:
        raise LinkError(f"the server sends a view that cannot be used: {error}") from error
    return tables
