import numpy as np
import pytest

from bridge.tcp.messages.cut_report import pack_cut_report, unpack_cut_report
from bridge.tcp.wire import MessageError
from tests.bridge.bits import bits
from tissue import CutReport, MeshMeasures

REPORT = CutReport(
    7,
    1e-5,
    3e-5,
    3e-3,
    4e-4,
    MeshMeasures(576, 3e-3, 900.0, 2e-3, 0.0, 0.0, 0.0),
    MeshMeasures(800, 5e-4, 3e3, np.inf, 5e-4, 1e-3, 0.25),
)


def test_a_cut_report_arrives_bit_for_bit():
    assert bits(unpack_cut_report(pack_cut_report(REPORT))) == bits(REPORT)


@pytest.mark.parametrize(
    "change",
    [
        {"n_cut_nodes": -1},
        {"path_error_mean": np.nan},
        {"guard": -1e-9},
        {"now": REPORT.now._replace(altitude=-np.inf)},
        {"initial": REPORT.initial._replace(n_tetrahedra=0)},
    ],
)
def test_a_cut_report_with_an_impossible_number_is_refused(change):
    with pytest.raises(MessageError):
        unpack_cut_report(pack_cut_report(REPORT._replace(**change)))
