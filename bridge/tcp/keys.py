"""The secret that both sides of a link share: where it is kept, and what is not taken for one."""

import binascii
import os
import secrets
import stat
from pathlib import Path

KEY_VARIABLE = "SCALPEL_SIM_KEY"
"""Environment variable that holds a key, where no file is named."""
NEW_KEY_BYTES = 32
"""[byte]. As long as the digest of the seals: a longer one would be no harder to guess."""
FEWEST_KEY_BYTES = 16
"""[byte]. 128 bits: what somebody who recorded a handshake cannot find by trying. A pass phrase
could be found, so a key is hexadecimal, and nobody is tempted."""
LARGEST_KEY_FILE = 1 << 12
"""[byte]. A key is a line."""


def chosen_key(path: Path | None) -> bytes | None:
    """Return the key in a file, else the one in the environment, else None.

    Raises:
        ValueError: what is there is no key, or others can read the file.
    """
    if path is not None:
        return read_key(path)
    text = os.environ.get(KEY_VARIABLE)
    return None if text is None else _key_in(text, f"the environment variable {KEY_VARIABLE}")


def read_key(path: Path) -> bytes:
    """Return the key in a file.

    Raises:
        ValueError: it cannot be read, holds no key, or others can read it.
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
            f"the key file {path} is open to other users of this machine; close it first: "
            f"chmod 600 {path}"
        )
    return _key_in(content.decode("ascii", "replace"), str(path))


def write_new_key(path: Path) -> None:
    """Write a new random key to a file that does not exist yet, and that only its owner can read.

    Raises:
        ValueError: the file exists.
        OSError: it cannot be written.
    """
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError as cause:
        raise ValueError(f"{path} exists already; a key is never written over") from cause
    with os.fdopen(descriptor, "w", encoding="ascii") as file:
        file.write(secrets.token_hex(NEW_KEY_BYTES) + "\n")


def _key_in(text: str, where: str) -> bytes:
    """Return the key that a text is. The text itself is not for an error message."""
    try:
        key = binascii.unhexlify(text.strip())
    except ValueError as cause:
        raise ValueError(
            f"{where} holds no key: wanted hexadecimal digits, as `scalpel-sim key FILE` writes "
            "them"
        ) from cause
    if len(key) < FEWEST_KEY_BYTES:
        raise ValueError(
            f"the key in {where} has {len(key)} bytes; wanted {FEWEST_KEY_BYTES} at least, as "
            "`scalpel-sim key FILE` writes them"
        )
    return key
