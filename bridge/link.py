"""Ways of a blade sweep to the tissue. The arm side cannot distinguish one link from another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, TypeGuard

import numpy as np

from bridge.description import NamedLabel, SceneView, TissueDescription
from bridge.driven import (
    NO_GEOM_LOADS,
    NO_GEOMS,
    FrameAttachment,
    FrameLoad,
    FramePose,
    FrameTie,
    GeomLoads,
    GeomPoses,
    expect_each,
    expect_pose_of_each,
)
from tissue import (
    BladeSweep,
    Chunks,
    CutFaces,
    CutReport,
    Deformation,
    FloatArray,
    Geom,
    IntArray,
    Snapshot,
    StepResult,
    Surface,
    SurfaceQuantity,
)

if TYPE_CHECKING:  # the side without the tissue starts without its compiler
    from bridge.collision.touched_geoms import TouchedGeoms
    from tissue import Attachment, Tissue


class LinkError(ConnectionError):
    """The tissue cannot be reached, does not answer, or its answer cannot be read."""


class TissueLink(Protocol):
    """A tissue in this process or in another one."""

    def describe(self) -> TissueDescription:
        """Return what the arm side must know of the body now."""

    @property
    def label_names(self) -> Mapping[int, str]:
        """Names of the labels of the body; none where it is in another process."""

    def step(
        self,
        sweep: BladeSweep | None,
        dt: float,
        poses: Sequence[FramePose] = (),
        geoms: GeomPoses = NO_GEOMS,
    ) -> StepResult:
        """Advance the tissue by `dt` [s] while the blade does `sweep` (None: no blade is near).

        Args:
            sweep: Motion of the blade.
            dt: Length of the step [s].
            poses: Poses of the attached frames at its end, one for each, in order.
            geoms: Poses of the geoms of `collide_with` at its end.

        Raises:
            ValueError: there is another number of poses, or a geom cannot move so.
            LinkError: the tissue is in another process and did not answer, or refuses the request.
        """

    def attach(self, attachment: FrameAttachment) -> int:
        """Attach a frame to the body, which the caller drives from now on; return its number.

        That is its place in `loads`, where those of the tissue's own scene come first.

        Raises:
            ValueError: see `tissue.Tissue.attach`.
            LinkError: the tissue is in another process, and refuses it or did not answer.
        """

    def tie(self, tie: FrameTie) -> int:
        """Tie the body by fibres to a frame, which the caller drives, as `attach` does.

        Raises:
            ValueError: see `tissue.Tissue.tie`.
            LinkError: the tissue is in another process, and refuses it or did not answer.
        """

    def release(self, number: int) -> None:
        """Release the frame of that number, which keeps its number; again it does nothing.

        Raises:
            ValueError: there is no such frame; `LinkError`, where the tissue is elsewhere.
        """

    def loads(self) -> Sequence[FrameLoad]:
        """Return what the body did to each frame in the last step, in the order of numbers.

        Raises:
            LinkError: the tissue is in another process and did not answer.
        """

    def collide_with(self, geoms: Sequence[Geom], poses: GeomPoses) -> None:
        """Replace the rigid geoms that the body touches; the caller drives them from now on.

        Args:
            geoms: The geoms.
            poses: Poses of the geoms now; each step takes those at its end.

        Raises:
            ValueError: see `tissue.Tissue.collide_with`.
            LinkError: the tissue is in another process, and refuses it or did not answer.
        """

    def geom_loads(self) -> GeomLoads:
        """Return what the body did to each of these geoms in the last step."""

    def snapshot(self) -> Snapshot:
        """Return the whole state of the body."""

    def chunks(self) -> Chunks:
        """Return boxes that together hold the body, and the speed of its fastest node."""

    def surface(self) -> Surface:
        """Return the boundary triangles, for a picture."""

    def surface_values(self, quantity: SurfaceQuantity) -> FloatArray:
        """Return a quantity at each vertex of `surface()`; see `Tissue.surface_values`."""

    def deformation(self) -> Deformation:
        """Return stress and strain of each tetrahedron now."""

    def n_pieces(self) -> int:
        """Return the number of connected pieces."""

    @property
    def n_cut_faces(self) -> int:
        """Number of faces that cuts have opened; over a connection as of the last step."""

    def cut_faces(self, since: int = 0) -> CutFaces:
        """Return the faces that cuts have opened, in order; see `Tissue.cut_faces`.

        Args:
            since: Number of the first of them: those before are known.

        Raises:
            ValueError: fewer faces were cut.
        """

    def positions_of(self, at_rest: FloatArray, holders: IntArray) -> FloatArray:
        """Return where material points are now [m], shape (n, 3).

        Args:
            at_rest: Where they are in the body at rest [m], shape (n, 3).
            holders: Tetrahedron that held each when it was looked up last, or -1; written.
                Shape (n,).
        """

    def cut_report(self) -> CutReport:
        """Return the path error of the cuts so far, and their effect on elements and time step."""

    def close(self) -> None:
        """Release the tissue, and the connection if there is one."""


class InProcessLink:
    """A link to a tissue in this process.

    Args:
        tissue: The tissue.
        scene: Its name, as the command line gives it; for reports only.
        views: Cameras of its scene.
    """

    def __init__(self, tissue: Tissue, scene: str = "", views: Sequence[SceneView] = ()) -> None:
        self._tissue = tissue
        self._scene = scene
        self._views = tuple(views)
        # Of one that the tissue has released and forgotten, only the load, which stays: a state has
        # what is there.
        self._frames: list[Attachment | FrameLoad] = list(tissue.attachments)
        self._n_own = len(self._frames)
        self._geoms: TouchedGeoms | None = None
        self._n_geoms = 0

    @property
    def tissue(self) -> Tissue:
        """The tissue itself."""
        return self._tissue

    @property
    def label_names(self) -> Mapping[int, str]:
        """Names of the labels of the body."""
        return self._tissue.label_names

    def describe(self) -> TissueDescription:
        """Return what the arm side must know of the body now."""
        return TissueDescription(
            self._scene,
            self._tissue.material,
            self._tissue.bounds,
            self._tissue.n_tetrahedra,
            self._tissue.n_nodes,
            self._tissue.blade,
            self._tissue.floor,
            self._views,
            self._labels(),
            self.n_cut_faces,
        )

    def _labels(self) -> tuple[NamedLabel, ...]:
        """Return the labels of the body with their names."""
        names, present = self._tissue.label_names, sorted(set(self._tissue.labels().tolist()))
        named = tuple(NamedLabel(label, names.get(label, "")) for label in present)
        return named if len(named) > 1 or named[0].name else ()

    def step(
        self,
        sweep: BladeSweep | None,
        dt: float,
        poses: Sequence[FramePose] = (),
        geoms: GeomPoses = NO_GEOMS,
    ) -> StepResult:
        """Advance the tissue by `dt` [s]; see `TissueLink.step`."""
        if poses or self.n_driven:
            expect_each(poses, self.n_driven)
            for frame, pose in zip(self._frames[self._n_own :], poses, strict=True):
                if not isinstance(frame, FrameLoad):
                    frame.move(pose.origin, pose.rotation)
        if geoms is not NO_GEOMS or self._geoms is not None:
            expect_pose_of_each(geoms, self._n_geoms)
            if self._geoms is not None:
                self._geoms.move(geoms)
        released = [
            (i, frame)
            for i, frame in enumerate(self._frames)
            if not isinstance(frame, FrameLoad) and frame.is_released
        ]
        result = self._tissue.step(sweep, dt)
        for i, frame in released:
            self._frames[i] = _load_on(frame)
        return result

    def attach(self, attachment: FrameAttachment) -> int:
        """Attach a frame to the body; see `TissueLink.attach`."""
        return self._added(self._tissue.attach(**attachment._asdict()))

    def tie(self, tie: FrameTie) -> int:
        """Tie the body by fibres to a frame; see `TissueLink.tie`."""
        ends = tie.to[0] if len(tie.to) == 1 else tie.to
        return self._added(self._tissue.tie(**tie._asdict() | {"to": ends}))

    def _added(self, frame: Attachment) -> int:
        """Add a frame, and return its number."""
        self._frames.append(frame)
        return len(self._frames) - 1

    def release(self, number: int) -> None:
        """Release the frame of that number."""
        if not 0 <= number < len(self._frames):
            raise ValueError(f"there is no frame {number}; there are {len(self._frames)}")
        frame = self._frames[number]
        if not isinstance(frame, FrameLoad) and frame.n_points:
            self._tissue.release(frame)

    def loads(self) -> Sequence[FrameLoad]:
        """Return what the body did to each frame in the last step."""
        return [_load_on(frame) for frame in self._frames]

    @property
    def n_driven(self) -> int:
        """Number of frames that were attached over this link, whose poses each step takes."""
        return len(self._frames) - self._n_own

    def collide_with(self, geoms: Sequence[Geom], poses: GeomPoses) -> None:
        """Replace the geoms that the body touches; see `TissueLink.collide_with`."""
        from bridge.collision.touched_geoms import TouchedGeoms  # few need its collision library

        expect_pose_of_each(poses, len(geoms))
        self._geoms, self._n_geoms = TouchedGeoms(self._tissue, geoms, poses), len(geoms)

    def geom_loads(self) -> GeomLoads:
        """Return what the body did to each of these geoms in the last step."""
        return NO_GEOM_LOADS if self._geoms is None else self._geoms.loads

    @property
    def n_geoms(self) -> int:
        """Number of geoms of `collide_with`, whose poses each step takes."""
        return self._n_geoms

    def snapshot(self) -> Snapshot:
        """Return the whole state of the body."""
        return self._tissue.snapshot()

    def chunks(self) -> Chunks:
        """Return boxes that together hold the body, and the speed of its fastest node."""
        return self._tissue.chunks()

    def surface(self) -> Surface:
        """Return the boundary triangles, for a picture."""
        return self._tissue.surface()

    def surface_values(self, quantity: SurfaceQuantity) -> FloatArray:
        """Return a quantity at each vertex of `surface()`; see `Tissue.surface_values`."""
        return self._tissue.surface_values(quantity)

    def deformation(self) -> Deformation:
        """Return stress and strain of each tetrahedron now."""
        return self._tissue.deformation()

    def n_pieces(self) -> int:
        """Return the number of connected pieces."""
        return self._tissue.n_pieces()

    @property
    def n_cut_faces(self) -> int:
        """Number of faces that cuts have opened."""
        return self._tissue.n_cut_faces

    def cut_faces(self, since: int = 0) -> CutFaces:
        """Return the faces that cuts have opened, in order; see `Tissue.cut_faces`."""
        return self._tissue.cut_faces(since)

    def positions_of(self, at_rest: FloatArray, holders: IntArray) -> FloatArray:
        """Return where material points are now [m], shape (n, 3); see `TissueLink`."""
        from tissue import MaterialPoints  # with the compiler, which the tissue has loaded

        shares = np.zeros(len(holders))
        return self._tissue.positions_of(MaterialPoints(at_rest, holders, shares))

    def cut_report(self) -> CutReport:
        """Return the path error of the cuts so far, and their effect on elements and time step."""
        return self._tissue.cut_report()

    def close(self) -> None:
        """Do nothing: the tissue belongs to the caller."""


def link_to(tissue: Tissue | TissueLink) -> TissueLink:
    """Return a link to a tissue: the argument itself if it is one already.

    Raises:
        TypeError: the argument is neither a tissue nor a link.
    """
    if _is_link(tissue):
        return tissue
    from tissue import Tissue  # loads the compiler, as the caller has done to make a tissue

    if isinstance(tissue, Tissue):
        return InProcessLink(tissue)
    found = tissue.__name__ if isinstance(tissue, type) else type(tissue).__name__
    raise TypeError(
        f"a bridge needs a tissue.Tissue, or a link to one such as bridge.TcpLink; got {found}"
        + (", the class and not an object of it" if isinstance(tissue, type) else "")
    )


def _is_link(candidate: object) -> TypeGuard[TissueLink]:
    """Return whether an object has the methods of a link. A `Tissue` does not describe itself."""
    return not isinstance(candidate, type) and hasattr(candidate, "describe")


def _load_on(frame: Attachment | FrameLoad) -> FrameLoad:
    """Return the load on a frame in the last step."""
    return frame if isinstance(frame, FrameLoad) else FrameLoad(frame.wrench, frame.n_points)
