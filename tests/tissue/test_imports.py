"""What the engine imports."""

import subprocess
import sys


def test_the_engine_imports_no_arm_collision_or_viewer_package():
    """Neither MuJoCo, FCL and meshcat nor the other packages of the project are imported."""
    program = (
        "import sys, tissue.tissue\n"
        "print({'mujoco', 'fcl', 'meshcat', 'bridge', 'scalpel_sim'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True)
    assert done.stdout.strip() == b"set()"
