"""The reply with the path error of the cuts and their effect on the mesh."""

import struct

from bridge.tcp.messages.counts import check_counts
from bridge.tcp.wire import MessageError
from tissue import CutReport, MeshMeasures

_CUT_REPORT = struct.Struct("<16d3q")
CUT_REPORT_BYTES = _CUT_REPORT.size


def pack_cut_report(report: CutReport) -> bytes:
    """Return a reply: the floats of a report in the order of its fields, then its integers."""
    return _CUT_REPORT.pack(
        report.path_error_mean,
        report.path_error_largest,
        report.node_size,
        report.guard,
        *report.initial[1:],
        *report.now[1:],
        report.n_cut_nodes,
        report.initial.n_tetrahedra,
        report.now.n_tetrahedra,
    )


def unpack_cut_report(payload: bytes) -> CutReport:
    """Return the report in a reply.

    Raises:
        MessageError: the length is wrong, a number is negative or NaN, or there is no tetrahedron.
    """
    if len(payload) != _CUT_REPORT.size:
        raise MessageError(f"a cut report of {len(payload)} bytes; wanted {_CUT_REPORT.size}")
    numbers = _CUT_REPORT.unpack(payload)
    n_cut_nodes, n_initial, n_now = numbers[16:]
    check_counts(n_cut_nodes, min(n_initial, n_now) - 1)
    if not all(
        number >= 0.0 for number in numbers[:16]
    ):  # infinity is the time step of a body that cannot move
        raise MessageError(f"a cut report of {numbers[:16]}; wanted numbers of 0 or more")
    return CutReport(
        n_cut_nodes,
        numbers[0],
        numbers[1],
        numbers[2],
        numbers[3],
        MeshMeasures(n_initial, *numbers[4:10]),
        MeshMeasures(n_now, *numbers[10:16]),
    )
