"""Where a tissue lies in the world, given by itself or behind a bridge."""

from bridge import Bridge, TissueFrame
from tissue import Tissue


def frame_of(tissue: Tissue | Bridge, frame: TissueFrame) -> TissueFrame:
    """Return the frame of a tissue in the world: `frame`, or that of the bridge to it."""
    return tissue.frame if isinstance(tissue, Bridge) else frame
