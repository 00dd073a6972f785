"""Reads files with 3D Slicer's own libraries and prints what Slicer understood, as JSON: read_by_slicer.py FILE.

Run by the interpreter with PYTHONPATH set to the packages of slicer.txt; imports nothing of Spinewatch.
"""

import json
import sys
from contextlib import suppress
from typing import Any

with suppress(
    ImportError
):  # absent from the environment of the tests, which import this file for its examples
    import slicer  # type: ignore[import-not-found]
    import vtk  # type: ignore[import-not-found]


def markups(path: str) -> list[dict[str, object]]:
    scene = slicer.vtkMRMLScene()
    selection = slicer.vtkMRMLSelectionNode()
    selection.SetSingletonTag("Singleton")
    scene.AddNode(selection)
    logic = slicer.vtkSlicerMarkupsLogic()
    logic.SetMRMLScene(scene)
    logic.LoadMarkups(path)
    nodes = (
        scene.GetNthNodeByClass(i, "vtkMRMLMarkupsNode")
        for i in range(scene.GetNumberOfNodesByClass("vtkMRMLMarkupsNode"))
    )
    return [_markup(node) for node in nodes]


def _markup(node: Any) -> dict[str, object]:
    points = []
    for index in range(node.GetNumberOfControlPoints()):
        place = [0.0, 0.0, 0.0]
        node.GetNthControlPointPositionWorld(index, place)
        defined = node.GetNthControlPointPositionStatus(index) == slicer.vtkMRMLMarkupsNode.PositionDefined
        points.append({"label": node.GetNthControlPointLabel(index), "ras": place if defined else None})
    measurements = [node.GetNthMeasurement(index) for index in range(node.GetNumberOfMeasurements())]
    return {
        "class": node.GetClassName(),
        "name": node.GetName(),
        "points": points,
        "measurements": [
            {
                "class": item.GetClassName(),
                "name": item.GetName(),
                "value": item.GetValue(),
                "defined": bool(item.GetValueDefined()),
                "quantity": _code(item.GetQuantityCode()),
                "method": _code(item.GetMethodCode()),
                "units": _code(item.GetUnitsCode()),
            }
            for item in measurements
        ],
    }


def _code(entry: Any) -> list[str] | None:
    return entry and [entry.GetCodeValue(), entry.GetCodingSchemeDesignator(), entry.GetCodeMeaning()]


def transform(path: str) -> list[list[float]]:
    scene = slicer.vtkMRMLScene()
    storage = slicer.vtkMRMLTransformStorageNode()
    storage.SetFileName(path)
    node = slicer.vtkMRMLLinearTransformNode()
    scene.AddNode(storage)
    scene.AddNode(node)
    if not storage.ReadData(node):
        sys.exit(f"Slicer cannot read {path}")
    matrix = vtk.vtkMatrix4x4()
    node.GetMatrixTransformToParent(matrix)
    return [[matrix.GetElement(row, column) for column in range(4)] for row in range(4)]


if __name__ == "__main__":
    vtk.vtkObject.GlobalWarningDisplayOff()
    read = transform if sys.argv[1].endswith(".tfm") else markups
    sys.stdout.write(json.dumps(read(sys.argv[1])))
