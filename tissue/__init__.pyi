from .blade.toughness import ToughnessLaw as ToughnessLaw
from .blade.toughness import expect_toughness_in_range as expect_toughness_in_range
from .blade.toughness import toughness_law_of as toughness_law_of
from .blade_shape import BladeShape as BladeShape
from .boundary_conditions import fixed_nodes as fixed_nodes
from .contact.geoms.geom import Geom as Geom
from .contact.geoms.geom import GeomForces as GeomForces
from .contact.geoms.geom_contact import GeomContact as GeomContact
from .core.array_types import BoolArray as BoolArray
from .core.array_types import FloatArray as FloatArray
from .core.array_types import IntArray as IntArray
from .core.limits import LARGEST_COORDINATE as LARGEST_COORDINATE
from .core.limits import LARGEST_STRENGTH as LARGEST_STRENGTH
from .core.limits import MANY_SUBSTEPS as MANY_SUBSTEPS
from .core.limits import MOST_SUBSTEPS as MOST_SUBSTEPS
from .core.memento_reading import StateError as StateError
from .core.three_vectors import BladeSegment as BladeSegment
from .core.three_vectors import BladeSweep as BladeSweep
from .core.three_vectors import Wrench as Wrench
from .cut_settings import SCHEMES as SCHEMES
from .cut_settings import CutReport as CutReport
from .cut_settings import CutSettings as CutSettings
from .cut_settings import MeshMeasures as MeshMeasures
from .elasticity.spring_calibration import SpringError as SpringError
from .elasticity.spring_calibration import calibrated as calibrated
from .elasticity.spring_calibration import spring_error as spring_error
from .geometry.rotations import are_rotations as are_rotations
from .geometry.rotations import checked_rotation as checked_rotation
from .integrators.methods import RELAXATIONS as RELAXATIONS
from .integrators.methods import Global as Global
from .integrators.methods import Hierarchical as Hierarchical
from .integrators.methods import Verlet as Verlet
from .io.mesh_io import mesh_from_arrays as mesh_from_arrays
from .io.mesh_io import read_mesh as read_mesh
from .io.mesh_io import write_mesh as write_mesh
from .io.mesh_io import write_vtu as write_vtu
from .io.mesh_report import LabelShare as LabelShare
from .io.mesh_report import MeshReport as MeshReport
from .io.mesh_report import MeshShape as MeshShape
from .io.mesh_report import report_on_mesh as report_on_mesh
from .laws import LAWS as LAWS
from .laws.exponential import Exponential as Exponential
from .laws.law import Law as Law
from .laws.law import LawKey as LawKey
from .laws.law import Moduli as Moduli
from .laws.mass_spring import MassSpring as MassSpring
from .laws.neo_hookean import NeoHookean as NeoHookean
from .laws.yeoh import Yeoh as Yeoh
from .loads.attachment import Attachment as Attachment
from .loads.attachment import FramePath as FramePath
from .loads.attachment import Ligament as Ligament
from .loads.facing import Facing as Facing
from .loads.load import Load as Load
from .loads.material_points import MaterialPoints as MaterialPoints
from .loads.support_path import SupportPath as SupportPath
from .material import Material as Material
from .material_presets import DAMPING_BAND as DAMPING_BAND
from .material_presets import MATERIALS as MATERIALS
from .material_presets import Preset as Preset
from .material_presets import SourcedValue as SourcedValue
from .mesh.cut_faces import CutFaces as CutFaces
from .mesh.faces import boundary_faces as boundary_faces
from .mesh.joined import joined as joined
from .mesh.joined import placed as placed
from .mesh.mesh_arrays import MeshError as MeshError
from .mesh.pieces import piece_of_tetrahedra as piece_of_tetrahedra
from .mesh.pieces import pieces_of as pieces_of
from .mesh.rigid_cores import CoreCutError as CoreCutError
from .mesh.rigid_cores import CoreMotion as CoreMotion
from .shapes.block import block as block
from .shapes.block import lattice_block as lattice_block
from .shapes.cylinder import cylinder as cylinder
from .shapes.liver_lobe import liver_lobe as liver_lobe
from .solver_settings import ELEMENTS as ELEMENTS
from .solver_settings import PRECISIONS as PRECISIONS
from .solver_settings import SolverSettings as SolverSettings
from .state.tissue_state import TissueState as TissueState
from .stepping.acting_forces import ActingForce as ActingForce
from .tissue import Tissue as Tissue
from .types import CUT_COLOUR as CUT_COLOUR
from .types import SKIN_COLOUR as SKIN_COLOUR
from .types import AddedMass as AddedMass
from .types import BodyContacts as BodyContacts
from .types import Chunks as Chunks
from .types import Deformation as Deformation
from .types import Energies as Energies
from .types import Piece as Piece
from .types import RigidContacts as RigidContacts
from .types import SchemeStatistics as SchemeStatistics
from .types import Snapshot as Snapshot
from .types import StageTimes as StageTimes
from .types import StepResult as StepResult
from .types import Surface as Surface
from .types import SurfaceQuantity as SurfaceQuantity
from .types import TetrahedralMesh as TetrahedralMesh
from .types import TissueError as TissueError

__all__ = [
    "ActingForce",
    "AddedMass",
    "BladeSegment",
    "BladeShape",
    "BladeSweep",
    "BodyContacts",
    "BoolArray",
    "CUT_COLOUR",
    "Chunks",
    "CoreCutError",
    "CoreMotion",
    "CutFaces",
    "CutReport",
    "CutSettings",
    "DAMPING_BAND",
    "Deformation",
    "Energies",
    "Facing",
    "FloatArray",
    "Geom",
    "GeomContact",
    "GeomForces",
    "Global",
    "Hierarchical",
    "IntArray",
    "LARGEST_COORDINATE",
    "LARGEST_STRENGTH",
    "LAWS",
    "Exponential",
    "Law",
    "LawKey",
    "Moduli",
    "NeoHookean",
    "MassSpring",
    "Yeoh",
    "Attachment",
    "FramePath",
    "LabelShare",
    "Ligament",
    "Load",
    "MATERIALS",
    "MANY_SUBSTEPS",
    "MOST_SUBSTEPS",
    "Material",
    "MaterialPoints",
    "SupportPath",
    "MeshError",
    "MeshMeasures",
    "MeshReport",
    "MeshShape",
    "Piece",
    "ELEMENTS",
    "PRECISIONS",
    "Preset",
    "RELAXATIONS",
    "SCHEMES",
    "SKIN_COLOUR",
    "RigidContacts",
    "SchemeStatistics",
    "Snapshot",
    "SolverSettings",
    "SourcedValue",
    "SpringError",
    "StageTimes",
    "StateError",
    "StepResult",
    "Surface",
    "SurfaceQuantity",
    "TetrahedralMesh",
    "Tissue",
    "TissueError",
    "TissueState",
    "ToughnessLaw",
    "Wrench",
    "are_rotations",
    "block",
    "boundary_faces",
    "calibrated",
    "checked_rotation",
    "cylinder",
    "expect_toughness_in_range",
    "fixed_nodes",
    "joined",
    "lattice_block",
    "liver_lobe",
    "mesh_from_arrays",
    "piece_of_tetrahedra",
    "pieces_of",
    "placed",
    "read_mesh",
    "report_on_mesh",
    "spring_error",
    "toughness_law_of",
    "write_mesh",
    "write_vtu",
]
