"""MuJoCo's warnings, as messages of the logger `scalpel_sim`."""

import logging

import mujoco

_log = logging.getLogger("scalpel_sim")


def route_warnings() -> None:
    """Send MuJoCo's warnings to the logger `scalpel_sim`.

    By itself MuJoCo appends them to MUJOCO_LOG.TXT in the working directory. A handler that is
    already set stays.
    """
    if mujoco.get_mju_user_warning() is None:
        mujoco.set_mju_user_warning(_log_warning)


def _log_warning(text: str) -> None:
    _log.warning("MuJoCo: %s", text)
