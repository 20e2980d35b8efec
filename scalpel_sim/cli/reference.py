"""Writes docs/command_line.md from the live help of all commands.

Run it as `python -m scalpel_sim.cli.reference > docs/command_line.md`.
"""

import re

from scalpel_sim.cli.app import PROGRAM, app

_INTRODUCTION = f"""# The command line

This page is made from the program's own help: `python -m scalpel_sim.cli.reference >
docs/command_line.md`. `{PROGRAM} COMMAND --help` prints the same for one command.
"""


def command_line_reference() -> str:
    """Return the reference of all commands and options, in Markdown."""
    _, _, body = app.generate_docs().partition("\n")  # the title is ours
    # Under `python -m MODULE` the usage of a command would name that module too.
    body = re.sub(rf"^({PROGRAM}[a-z0-9 -]*?) -m \S+", r"\1", body, flags=re.MULTILINE)
    # The help of an option may be two lines of source; Markdown has it as one paragraph.
    body = re.sub(r"\n {4,}(?=\S)(?![*-] )", " ", body)
    return f"{_INTRODUCTION}{body.rstrip()}\n"


if __name__ == "__main__":
    print(command_line_reference(), end="")
