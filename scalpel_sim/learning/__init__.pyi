from .environment import TissueEnv as TissueEnv
from .episode import Episode as Episode
from .episode import Outcome as Outcome
from .episode_state import EpisodeState as EpisodeState
from .expert import Expert as Expert
from .parallel_env import TissueParallelEnv as TissueParallelEnv
from .parallel_env import parallel_env as parallel_env
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
    "TissueParallelEnv",
    "TissueVectorEnv",
    "parallel_env",
    "run_episode",
]
