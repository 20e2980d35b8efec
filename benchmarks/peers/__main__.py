"""Runs one adapter: python FOLDER ADAPTER BODY CASE CORE.

Standard output belongs to the protocol: one line of JSON for each answer, which `protocol`
describes.
"""

import importlib
import json
import os
import sys
from pathlib import Path


def _main() -> None:
    """Load the adapter and serve the case."""
    adapter, file, case, core = sys.argv[1:5]
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {int(core)})
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what a library prints must not get among the answers
    folder = Path(__file__).resolve().parent
    sys.path.insert(0, str(folder.parent))
    protocol = importlib.import_module(f"{folder.name}.protocol")
    sys.path.pop(0)  # else the project's other files would be found as modules
    make = getattr(importlib.import_module(f"{folder.name}.{adapter}"), adapter)
    try:
        body = protocol.read_body(file)
        stepper = make(body, case)
        stepper.steps(protocol.N_WARM_UP)
    except Exception as error:
        answers.write(json.dumps({"failed": f"{type(error).__name__}: {error}"}) + "\n")
        return
    protocol.answer_requests(body, stepper, sys.stdin, answers)


if __name__ == "__main__":
    _main()
