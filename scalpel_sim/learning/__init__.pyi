from .environment import TissueEnv as TissueEnv
from .episode import Episode as Episode
from .episode import Outcome as Outcome
from .episode_state import EpisodeState as EpisodeState
from .expert import Expert as Expert
from .rollout import POLICIES as POLICIES
from .rollout import EpisodeEnd as EpisodeEnd
from .rollout import run_episode as run_episode
from .vector_env import TissueVectorEnv as TissueVectorEnv

__all__ = [
    "POLICIES",
    "Episode",
    "EpisodeEnd",
    "EpisodeState",
    "Expert",
    "Outcome",
    "TissueEnv",
    "TissueVectorEnv",
    "run_episode",
]
