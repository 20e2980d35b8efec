"""Which geoms of a run MuJoCo lets collide, beside those that a model's own bits let.

An arm collides with other arms and with what stands beside it: a table, fixtures. Whether it
collides with itself and with the world of its own model is as the model says. Tissue is not among
them: MuJoCo does not know it.
"""

import mujoco

STANDING = 1 << 16
"""Bit of `contype` of what stands beside arms."""

ARM_GROUPS = tuple(1 << bit for bit in range(17, 31))
"""Bits of `contype` of arms, one each."""

_ALL = STANDING | sum(ARM_GROUPS)


def collide_as_one_arm(spec: mujoco.MjSpec, there: mujoco.MjSpec) -> None:
    """Let the bodies of an arm collide with other arms, and with what stands beside it.

    Of a body those geoms take part that the model lets collide at all; where it lets none, all.

    Args:
        spec: The arm, yet to be compiled.
        there: The model that it is to be a part of, or the arm itself.

    Raises:
        ValueError: there are too many arms.
    """
    taken = 0
    for geom in there.geoms:
        taken |= geom.contype
    group = next((bit for bit in ARM_GROUPS if not bit & taken), None)
    if group is None:
        raise ValueError(
            f"there are more than {len(ARM_GROUPS)} arms, which MuJoCo cannot tell apart"
        )
    for body in spec.bodies[1:]:
        if body.mocap:  # a hand is not solid
            continue
        geoms = list(body.geoms)
        for geom in [each for each in geoms if each.contype or each.conaffinity] or geoms:
            geom.contype |= group
            geom.conaffinity |= _ALL & ~group


def collide(model: mujoco.MjModel, one: int, other: int) -> bool:
    """Return whether MuJoCo lets two geoms collide that are no neighbours, by their numbers."""
    if model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CONTACT):
        return False
    contype, conaffinity = model.geom_contype, model.geom_conaffinity
    return bool(contype[one] & conaffinity[other] or contype[other] & conaffinity[one])
