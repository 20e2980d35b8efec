"""The secret key that both sides of a link share: where it is kept, and how it is checked."""

import binascii
import os
import secrets
import stat
from pathlib import Path

from tissue.support import new_whole_file

KEY_VARIABLE = "SCALPEL_SIM_KEY"
"""Environment variable that holds a key, if no file is given."""
NEW_KEY_BYTES = 32
"""Length of a new key [byte]: that of a SHA-256 digest. A longer key would be no harder to
guess."""
MIN_KEY_BYTES = 16
"""Length of the shortest key [byte]: 128 bits cannot be found by trying from a recorded handshake.
A pass phrase could be, so keys are hexadecimal to discourage one."""
LARGEST_KEY_FILE = 1 << 12
"""Largest file that is read for a key [byte]. A key is one line."""


def chosen_key(path: Path | None) -> bytes | None:
    """Return the key in a file, else the one in the environment, else None.

    Raises:
        ValueError: file or variable hold no key, or other users can read the file.
    """
    if path is not None:
        return read_key(path)
    text = os.environ.get(KEY_VARIABLE)
    return None if text is None else _key_in(text, f"the environment variable {KEY_VARIABLE}")


def read_key(path: Path) -> bytes:
    """Return the key in a file.

    Raises:
        ValueError: the file cannot be read, holds no key, or other users can read it.
    """
    try:
        with path.open("rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            content = file.read(LARGEST_KEY_FILE)
    except OSError as cause:
        raise ValueError(
            f"the key file {path} cannot be read: {cause.strerror}. `scalpel-sim key {path}` makes "
            "a new one"
        ) from cause
    if os.name == "posix" and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise ValueError(
            f"the key file {path} is open to other users of this machine; restrict it first: "
            f"chmod 600 {path}"
        )
    return _key_in(content.decode("ascii", "replace"), str(path))


def write_new_key(path: Path) -> None:
    """Write a new random key to a new file that only its owner can read.

    Raises:
        ValueError: the file exists.
        OSError: the file cannot be written; the message names it.
    """
    try:
        with new_whole_file(path) as unfinished:
            descriptor = os.open(unfinished, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(descriptor, "w", encoding="ascii") as file:
                file.write(secrets.token_hex(NEW_KEY_BYTES) + "\n")
    except FileExistsError as cause:
        raise ValueError(
            f"{path} exists already, and a key is never overwritten; choose another file"
        ) from cause
    except OSError as cause:
        raise OSError(
            f"the key file {path} cannot be written: {cause.strerror or cause}; choose another file"
        ) from cause


def _key_in(text: str, where: str) -> bytes:
    """Return the key in a text. An error message must not show the text itself."""
    try:
        key = binascii.unhexlify(text.strip())
    except ValueError as cause:
        raise ValueError(
            f"{where} holds no key: wanted hexadecimal digits, as `scalpel-sim key FILE` writes "
            "them"
        ) from cause
    if len(key) < MIN_KEY_BYTES:
        raise ValueError(
            f"the key in {where} has {len(key)} bytes; wanted at least {MIN_KEY_BYTES}, as "
            "`scalpel-sim key FILE` writes them"
        )
    return key
