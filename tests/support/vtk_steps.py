"""A recording as VTK reads it, whose own HDF5 library is another one than that of h5py."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader


class VtkStep(NamedTuple):
    """A step as VTK has it."""

    points: np.ndarray
    tetrahedra: np.ndarray
    point_data: dict[str, np.ndarray]
    cell_data: dict[str, np.ndarray]


class VtkSteps:
    """The steps of a file. It reads them in any order, one at a time."""

    def __init__(self, path: Path) -> None:
        self._reader = vtkHDFReader()
        assert self._reader.CanReadFile(str(path))
        self._reader.SetFileName(str(path))
        self._reader.UpdateInformation()
        information = self._reader.GetOutputInformation(0)
        times = information.Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
        self.times = np.array(times or [0.0])

    def __len__(self) -> int:
        return int(self._reader.GetNumberOfSteps())

    def step(self, number: int) -> VtkStep:
        """Return a step."""
        self._reader.SetStep(number)
        self._reader.Update()
        grid = self._reader.GetOutputDataObject(0)
        assert grid.IsA("vtkUnstructuredGrid")
        cells = grid.GetCells()
        assert np.array_equal(
            vtk_to_numpy(cells.GetOffsetsArray()), 4 * np.arange(grid.GetNumberOfCells() + 1)
        )
        assert {grid.GetCellType(i) for i in range(grid.GetNumberOfCells())} == {10}
        return VtkStep(
            vtk_to_numpy(grid.GetPoints().GetData()),
            vtk_to_numpy(cells.GetConnectivityArray()).reshape(-1, 4),
            _arrays(grid.GetPointData()),
            _arrays(grid.GetCellData()),
        )


def _arrays(data) -> dict[str, np.ndarray]:
    names = [data.GetArrayName(i) for i in range(data.GetNumberOfArrays())]
    return {name: vtk_to_numpy(data.GetArray(name)) for name in names}
