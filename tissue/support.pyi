from .core.array_types import dtype_of as dtype_of
from .core.jit import SameTypes as SameTypes
from .core.jit import is_compiling as is_compiling
from .core.jit import kernel as kernel
from .core.kernel_bundle import LEVELS as LEVELS
from .core.kernel_bundle import bundle_name as bundle_name
from .core.kernel_bundle import bundled as bundled
from .core.kernel_bundle import write_bundle as write_bundle
from .core.kernel_folder import cache_directory as cache_directory
from .core.kernel_folder import n_compiled_kernels as n_compiled_kernels
from .core.memento import Memento as Memento
from .core.memento import StateRules as StateRules
from .core.vec3 import Vec3 as Vec3
from .core.vec3 import add as add
from .core.vec3 import axpy as axpy
from .core.vec3 import dot as dot
from .core.vec3 import lerp as lerp
from .core.vec3 import norm as norm
from .core.vec3 import scale as scale
from .core.vec3 import sub as sub
from .core.vec3 import vec3 as vec3
from .geometry.line_entries import write_entries as write_entries
from .geometry.surface_places import PlaceTree as PlaceTree
from .geometry.surface_places import deepen as deepen
from .geometry.surface_places import least_distance as least_distance
from .geometry.surface_places import mark_near_triangles as mark_near_triangles
from .geometry.surface_places import place_tree as place_tree
from .geometry.surface_places import write_distances as write_distances
from .geometry.surface_places import write_holders as write_holders
from .geometry.triangle_places import count_places as count_places
from .geometry.triangle_places import write_edge_places as write_edge_places
from .geometry.triangle_places import write_parts as write_parts
from .io.mesh_io import read_mesh_file as read_mesh_file
from .io.mesh_io import stand_in as stand_in
from .io.mesh_report import likely_unit as likely_unit
from .io.whole_file import new_whole_file as new_whole_file
from .io.whole_file import remove_unfinished as remove_unfinished
from .io.whole_file import whole_file as whole_file
from .mesh.faces import OUTWARD as OUTWARD
from .mesh.faces import sorted_faces as sorted_faces
from .mesh.parts import labels_of_part as labels_of_part
from .mesh.pieces import components as components
from .mesh.validation import quality as quality
from .mesh.validation import signed_volumes as signed_volumes
from .shapes.labelled_stuffing import stuff_labels as stuff_labels
from .state.tissue_state import Around as Around

__all__ = [
    "dtype_of",
    "LEVELS",
    "Around",
    "Memento",
    "SameTypes",
    "StateRules",
    "Vec3",
    "add",
    "axpy",
    "bundle_name",
    "bundled",
    "cache_directory",
    "components",
    "dot",
    "is_compiling",
    "likely_unit",
    "kernel",
    "labels_of_part",
    "lerp",
    "norm",
    "scale",
    "sub",
    "vec3",
    "PlaceTree",
    "count_places",
    "deepen",
    "least_distance",
    "mark_near_triangles",
    "place_tree",
    "write_distances",
    "write_edge_places",
    "write_entries",
    "write_holders",
    "write_parts",
    "n_compiled_kernels",
    "new_whole_file",
    "quality",
    "read_mesh_file",
    "remove_unfinished",
    "signed_volumes",
    "OUTWARD",
    "sorted_faces",
    "stand_in",
    "stuff_labels",
    "whole_file",
    "write_bundle",
]
