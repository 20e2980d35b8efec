"""One pass of a cut: nodes where the sheet crosses the mesh, the crack front, and separation.

One kernel, for each call from Python takes as long as a pass in which nothing is cut.
"""

from typing import Final

from tissue.core.jit import kernel
from tissue.cutting.bridging import remember_active, resolve_bridges
from tissue.cutting.crack_front import bring_front_to_blade, extend_fronts
from tissue.cutting.separation import close_sheet, open_sheet
from tissue.cutting.snapping import insert_crossings
from tissue.cutting.workspace import Cut
from tissue.mesh.changes import clear_changes

ALONG_PATH: Final = 0
"""Cut what was detected along the path of the edge."""
TO_EDGE: Final = 1
"""Cut up to the edge itself, which rests."""
TO_THE_END: Final = 2
"""Cut what remains when the blade has left the incision."""


@kernel
def cut_in_a_pass(cut: Cut, how_far: int) -> None:
    """Cut what was detected, as far as there is room; `how_far`: one of the constants above."""
    clear_changes(cut.change)
    if how_far == TO_EDGE:
        bring_front_to_blade(cut)
    else:
        insert_crossings(cut)
        extend_fronts(cut)
    resolve_bridges(cut)
    if how_far == TO_THE_END:
        close_sheet(cut)
    else:
        open_sheet(cut)
    remember_active(cut)
