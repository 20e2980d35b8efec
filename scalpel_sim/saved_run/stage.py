"""The part of a recorded run that does not change: what a page draws it with.

The records have names and fields of their own, by which they are written: a file stays readable
where a class of the viewer gets another field.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Self

import msgspec

from bridge import TissueFrame
from scalpel_sim.scene.label_colours import LabelColours
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.simulation import Simulation
from scalpel_sim.viewer.looks import ORGAN_LOOK, Look, Ramp, look_of_scene
from scalpel_sim.viewer.model_shapes import (
    ModelCamera,
    Shape,
    arm_bodies,
    perspective_cameras,
    shapes_of,
)
from scalpel_sim.viewer.packing import pack, unpack
from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import FloatArray, IntArray


class _ShapeRecord(msgspec.Struct):
    """A shape of the arm's model; see `Shape` and `TriangleMesh`."""

    name: str
    geom: int
    body: int
    root: int
    kind: int
    positions: FloatArray
    triangles: IntArray
    normals: FloatArray
    uv: FloatArray | None
    pose: FloatArray
    colour: FloatArray
    edge: tuple[FloatArray, FloatArray] | None
    is_target: bool

    @classmethod
    def of(cls, shape: Shape) -> Self:
        """Return the record of a shape."""
        mesh = shape.mesh
        return cls(
            shape.name,
            shape.geom,
            shape.body,
            shape.root,
            shape.kind,
            mesh.positions,
            mesh.triangles,
            mesh.normals,
            mesh.uv,
            shape.pose,
            shape.colour,
            shape.edge,
            shape.is_target,
        )

    def shape(self) -> Shape:
        """Return the shape."""
        return Shape(
            name=self.name,
            geom=self.geom,
            body=self.body,
            root=self.root,
            kind=self.kind,
            mesh=TriangleMesh(self.positions, self.triangles, self.normals, self.uv),
            pose=self.pose,
            colour=self.colour,
            edge=self.edge,
            is_target=self.is_target,
        )


class _CameraRecord(msgspec.Struct):
    """A camera of the arm's model; see `ModelCamera`."""

    name: str
    number: int
    fov_degrees: float


class _StageRecord(msgspec.Struct):
    """Shapes, cameras and the look of the body; see `Stage` and `Look`."""

    shapes: list[_ShapeRecord]
    views: list[ViewTable]
    cameras: list[_CameraRecord]
    arm_bodies: list[int]
    graspers: dict[str, list[int]]
    skin: Ramp
    inside: Ramp
    vessels: float
    fibres: float
    rim: float
    variation: float
    translucency: float
    glow: int
    labels: tuple[LabelColours, ...]


class Stage(NamedTuple):
    """The arm and its cameras, and how the body looks."""

    shapes: Sequence[Shape]
    """Visible shapes of the arm's model."""
    views: Sequence[ViewTable] = ()
    """Cameras of the scene."""
    cameras: Sequence[ModelCamera] = ()
    """Cameras of the arm's model."""
    arm_bodies: Sequence[int] = ()
    """Numbers of the bodies of arms; the others are part of the world."""
    graspers: Mapping[str, Sequence[int]] = {}
    """Of each grasper its bodies."""
    look: Look = ORGAN_LOOK
    """Look of the body's material."""

    def to_bytes(self) -> bytes:
        """Return it as MessagePack."""
        look = self.look
        return pack(
            _StageRecord(
                [_ShapeRecord.of(shape) for shape in self.shapes],
                list(self.views),
                [_CameraRecord(*each) for each in self.cameras],
                list(self.arm_bodies),
                {name: list(bodies) for name, bodies in self.graspers.items()},
                look.skin,
                look.inside,
                look.vessels,
                look.fibres,
                look.rim,
                look.variation,
                look.translucency,
                look.glow,
                look.labels,
            )
        )

    @classmethod
    def from_bytes(cls, content: bytes) -> Self:
        """Return the stage that was written.

        Raises:
            msgspec.ValidationError: it is none.
        """
        record = unpack(content, _StageRecord)
        look = Look(
            skin=record.skin,
            inside=record.inside,
            vessels=record.vessels,
            fibres=record.fibres,
            rim=record.rim,
            variation=record.variation,
            translucency=record.translucency,
            glow=record.glow,
            labels=record.labels,
        )
        return cls(
            [each.shape() for each in record.shapes],
            record.views,
            [ModelCamera(each.name, each.number, each.fov_degrees) for each in record.cameras],
            record.arm_bodies,
            record.graspers,
            look,
        )


def stage_of(simulation: Simulation) -> Stage:
    """Return the stage of a simulation."""
    model, scene = simulation.arm.model, simulation.scene
    return Stage(
        list(shapes_of(model)),
        () if scene is None else scene.views,
        perspective_cameras(model),
        arm_bodies(model).tolist(),
        {
            each.name: [model.body(name).id for name in each.grasper.bodies]
            for each in simulation.graspers
        },
        ORGAN_LOOK if scene is None else look_of_scene(scene),
    )


def frame_from(rows: FloatArray) -> TissueFrame:
    """Return the pose of the tissue in the world from its axes, then its origin, shape (4, 3)."""
    return TissueFrame(rows[:3].T, rows[3])


def rows_of(frame: TissueFrame) -> list[list[float]]:
    """Return axes of the tissue in the world, and its origin [m], a row each."""
    return [*frame.rotation.T.tolist(), frame.origin.tolist()]
