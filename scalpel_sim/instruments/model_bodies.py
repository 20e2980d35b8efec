"""Bodies of a MuJoCo model by their names."""

import mujoco


def body_number(model: mujoco.MjModel, name: str, error: type[ValueError]) -> int:
    """Return MuJoCo's number of a body.

    Args:
        model: The model.
        name: Name of the body.
        error: What to raise where there is none.

    Raises:
        ValueError: `error`, with the names that there are.
    """
    number = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name))
    if number < 0:
        names = [model.body(i).name for i in range(1, model.nbody)]
        there = ", ".join(f"'{each}'" for each in names if each) or "none with a name"
        raise error(f"the model has no body '{name}'. It has: {there}")
    return number
