from .environment import TissueEnv as TissueEnv
from .episode import Episode as Episode
from .episode import Outcome as Outcome
from .expert import Expert as Expert
from .rollout import POLICIES as POLICIES
from .rollout import EpisodeEnd as EpisodeEnd
from .rollout import run_episode as run_episode

__all__ = [
    "POLICIES",
    "Episode",
    "EpisodeEnd",
    "Expert",
    "Outcome",
    "TissueEnv",
    "run_episode",
]
