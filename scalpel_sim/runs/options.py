"""The options of the command line about a run: its files, its page, its device, what is printed.

Each group is a dataclass that several commands share. An option that is not given is None.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter

Flag = Annotated[bool, Parameter(negative="", show_default=False)]
"""An option that is given or not, and has no value."""

CONNECTION = Group("Connection", sort_key=6)
_PAGE = Group("Page", sort_key=7)
DEVICE = Group("Device", sort_key=8)
OUTPUT = Group("Output", sort_key=9)

SERVER_PATIENCE = 120.0
"""Longest wait for a program that was started at the same time and does not listen yet [s]: where
kernels are compiled first, that takes a minute."""


@Parameter(name="*", group=CONNECTION)
@dataclass(frozen=True)
class ClientOptions:
    """A tissue in another process."""

    connect: str | None = None
    """HOST:PORT of a `scalpel-sim serve`, which holds the tissue, and may still get ready for
    two minutes [default: it is in this process]."""
    key: Path | None = None
    "File with the key of that server [default: the key in SCALPEL_SIM_KEY, if that is set]."


@Parameter(name="*", group=_PAGE)
@dataclass(frozen=True)
class PageOptions:
    """The page of a live run."""

    hand: Literal["script", "live", "device"] = "script"
    """Who leads blade and graspers: script, the scene; live, you in the page, until you end it
    there or --seconds have passed; or device, a program that connects and leads the blade. What
    was done is written: stroke.csv and grasper_NAME.csv."""
    wireframe: Flag = False
    "Show the edges of the mesh."
    port: int | None = None
    "Port of the page, on this machine only [default: any free port]."


@Parameter(name="*", group=DEVICE)
@dataclass(frozen=True)
class DeviceOptions:
    """A device that leads the blade, with `--hand device`."""

    listen: str | None = None
    """HOST:PORT at which the run waits for the device: any host with a key, else one of this
    machine alone; port 0 for any free one [default: 127.0.0.1:8767]."""
    listen_key: Path | None = None
    """Only devices may lead that have the key in this file [default: the key in SCALPEL_SIM_KEY,
    if that is set]."""
    watchdog: float | None = None
    "The blade rests when no pose has come for so long, in wall time [s; default: 0.04]."
    client_stops: Literal["hold", "end"] | None = None
    """Effect on the run of a device that falls silent, or disconnects: hold [default], the blade
    rests until a device comes again; or end, the run ends."""


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class OutputOptions:
    """The files that a run writes."""

    out: Path | None = None
    "Folder for the files [default: out/SCENE]."
    export: Annotated[tuple[Path, ...], Parameter(negative="", show_default=False)] = ()
    """Write the body's surface after the run to this file too: .glb, .obj, .usd, .usda, .usdc
    (pieces and cut faces by name), .ply (marked on each face) or .stl (triangles alone). May be
    given several times."""
    record: Path | None = None
    """Write the run to this FILE.vtkhdf too, 25 steps a second: body, stress, strain, labels, age
    of cuts, arm and forces. ParaView plays it, and so does scalpel-sim replay; it is whole however
    the run ends."""
    checkpoint: float | None = None
    """Every so many seconds of simulated time the whole run is written to its folder, so that one
    that was killed can continue (run --resume); 0: never [default: 1]."""


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class RunOutputOptions(OutputOptions):
    """The files that a run writes, or has written, and how it ends."""

    resume: Path | None = None
    """Continue the run that was interrupted, or killed, while it wrote to this folder, to the
    same bits, and its recording too. What is requested is in the folder: give no other options than
    --export, --record, --checkpoint, --strict, and what is printed."""
    strict: Flag = False
    """End with exit code 4 where the run ended with a warning: a cut that is unfinished, a blade
    that is still in the tissue, an account that does not close."""


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class PrintOptions:
    """Options of printing."""

    json: Flag = False
    "Print the result as JSON on standard output, and nothing else there."
    quiet: Annotated[Flag, Parameter(name=["--quiet", "-q"])] = False
    "Print nothing but errors."
    verbose: Annotated[Flag, Parameter(name=["--verbose", "-v"])] = False
    "Print what is being done; after an error, also where in the program it arose."
