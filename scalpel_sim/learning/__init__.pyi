from .environment import TissueEnv as TissueEnv
from .episode import Episode as Episode
from .episode import Outcome as Outcome
from .expert import Expert as Expert

__all__ = ["Episode", "Expert", "Outcome", "TissueEnv"]
