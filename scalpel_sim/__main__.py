"""`python -m scalpel_sim` is `scalpel-sim`."""

import contextlib
import gc
import os
import sys
from typing import NoReturn

from scalpel_sim.camera.gl_context import set_backend_aside
from scalpel_sim.errors import EXIT_RUN_FAILED
from scalpel_sim.runs.stop_signals import ignore_signals, interrupt_on_signals, raised_signal


def main() -> None:
    """Run the command line, and end the process with its exit code.

    Signals are obeyed before the command line is loaded, which takes most of a second.
    """
    interrupt_on_signals()
    set_backend_aside()
    # What is loaded lives as long as the process: to look for cycles in it took 0.13 s of a start.
    # `load_kernels` enables the collector again.
    gc.disable()
    try:
        from scalpel_sim.cli.app import command_line

        code = command_line(sys.argv[1:])
    except ModuleNotFoundError as error:  # of the command line: not even `doctor` can be asked
        print(f"error: {error}; install scalpel-sim with all it needs", file=sys.stderr)
        code = EXIT_RUN_FAILED
    except KeyboardInterrupt as error:  # one more signal, while the first was reported
        print(f"error: {error}", file=sys.stderr)
        code = EXIT_RUN_FAILED
    ignore_signals()  # all is done, and a signal would change the code
    if raised_signal() is not None:
        _end_at_once(code)
    sys.exit(code)


def _end_at_once(code: int) -> NoReturn:
    """End the process without taking down what was loaded.

    What a signal has interrupted stays as it is: see `scalpel_sim.runs.stop_signals`.
    """
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError):  # nobody reads it any more
            stream.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
