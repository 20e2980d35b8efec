"""`python -m scalpel_sim` is `scalpel-sim`."""

import gc
import os
import sys

from scalpel_sim.stop_signals import ignore_signals, interrupt_on_signals


def main() -> None:
    """Run the command line, and end the process with its exit code.

    Signals are waited for before the command line is loaded, which takes most of a second.
    """
    interrupt_on_signals()
    # The program opens no window. To have one, MuJoCo loads glfw, which starts a process that looks
    # for its library, and that writes a traceback where a signal ends the program meanwhile.
    os.environ.setdefault("MUJOCO_GL", "disable")
    # What is loaded lives as long as the process: to look for cycles in it took 0.13 s of a start.
    # `load_kernels` enables the collector again.
    gc.disable()
    try:
        from scalpel_sim.cli.app import command_line

        code = command_line(sys.argv[1:])
    except KeyboardInterrupt as error:
        from scalpel_sim.errors import EXIT_RUN_FAILED

        print(f"error: {error}", file=sys.stderr)
        code = EXIT_RUN_FAILED
    ignore_signals()  # all is done, and a signal would change the code
    sys.exit(code)


if __name__ == "__main__":
    main()
