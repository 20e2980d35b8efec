"""Open a dataset of demonstrations with LeRobot, and train ACT on it for some steps.

LeRobot has requirements of its own, so it is installed in an environment of its own:

    uv venv --python 3.12 lerobot && uv pip install --python lerobot "lerobot[dataset]==0.6.1"
    lerobot/bin/python lerobot_act.py FOLDER 10
"""

import argparse
import time
from pathlib import Path

import torch
from lerobot.datasets.lerobot_dataset import LeRobotDataset, LeRobotDatasetMetadata
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.act.modeling_act import ACTPolicy
from lerobot.policies.factory import make_pre_post_processors
from lerobot.utils.feature_utils import dataset_to_policy_features

CHUNK = 20
"""Control steps that the policy does from one look to the next."""

BATCH = 8

NAME = "local/demonstrations"
"""Name that LeRobot wants of a dataset, also of one in a folder."""


def config_of(meta: LeRobotDatasetMetadata) -> ACTConfig:
    """Return an ACT that is small enough for a processor, with no weights from elsewhere."""
    features = dataset_to_policy_features(meta.features)
    seen = {
        name: each
        for name, each in features.items()
        if name in ("observation.state", "observation.wrench", *meta.camera_keys)
    }
    return ACTConfig(
        input_features=seen,
        output_features={"action": features["action"]},
        chunk_size=CHUNK,
        n_action_steps=CHUNK,
        pretrained_backbone_weights=None,
        dim_model=128,
        dim_feedforward=256,
        n_heads=4,
        device="cpu",
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("steps", type=int, default=10, nargs="?")
    parser.add_argument("--out", type=Path, help="folder for the policy")
    options = parser.parse_args()
    torch.manual_seed(0)
    meta = LeRobotDatasetMetadata(NAME, root=options.folder)
    config = config_of(meta)
    ahead = {"action": [i / meta.fps for i in config.action_delta_indices]}
    dataset = LeRobotDataset(NAME, root=options.folder, delta_timestamps=ahead)
    print(f"{dataset.num_episodes} episodes, {len(dataset)} frames, {meta.fps} a second")
    for name, each in sorted(meta.features.items()):
        print(f"  {name}: {each['dtype']} {tuple(each['shape'])}")
    policy = ACTPolicy(config)
    before, _ = make_pre_post_processors(config, dataset_stats=meta.stats)
    optimizer = torch.optim.AdamW(policy.get_optim_params(), lr=1e-4)
    frames = torch.utils.data.DataLoader(dataset, BATCH, shuffle=True)
    policy.train()
    done, began = 0, time.perf_counter()
    while done < options.steps:
        for batch in frames:
            loss, _ = policy(before(batch))
            optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(policy.parameters(), 10.0)
            optimizer.step()
            done += 1
            print(f"step {done}: loss {loss.item():.4f}")
            if done == options.steps:
                break
    print(f"{done} steps in {time.perf_counter() - began:.1f} s")
    if options.out is not None:
        policy.save_pretrained(options.out)


if __name__ == "__main__":
    main()
