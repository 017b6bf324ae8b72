# SPDX-License-Identifier: MIT OR Apache-2.0
"""Times one of VTK's own volume mappers on a scene, and writes its picture: a process of its own, so that its CPU seconds are its own.

    python3 vtk_frames.py SCENE.json projected|bunyk|fixed|gpu VIEWS OUT.npy

Of a scene of image data "fixed" and "gpu" are the mappers, with a sample for each pixel and voxel; opacity is per unit distance there.

Prints one JSON object: wall and CPU seconds of each view, and VTK's version.
"""
import json
import sys
import time

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 (registers the classes that draw)
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction, vtkPlane  # noqa: F401
from vtkmodules.vtkFiltersGeneral import vtkDataSetTriangleFilter
from vtkmodules.vtkIOXML import vtkXMLImageDataReader, vtkXMLUnstructuredGridReader
from vtkmodules.vtkRenderingCore import (vtkColorTransferFunction, vtkRenderer, vtkRenderWindow, vtkVolume, vtkVolumeProperty,
                                         vtkWindowToImageFilter)
from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper, vtkUnstructuredGridVolumeRayCastMapper
from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkOpenGLGPUVolumeRayCastMapper, vtkOpenGLProjectedTetrahedraMapper


IMAGES = {"fixed": vtkFixedPointVolumeRayCastMapper, "gpu": vtkOpenGLGPUVolumeRayCastMapper}


def mapper_of(name):
    if name == "projected":
        return vtkOpenGLProjectedTetrahedraMapper()
    if name in IMAGES:
        mapper = IMAGES[name]()
        mapper.AutoAdjustSampleDistancesOff()
        mapper.LockSampleDistanceToInputSpacingOff()
        mapper.SetSampleDistance(1)
        mapper.SetImageSampleDistance(1)
        return mapper
    mapper = vtkUnstructuredGridVolumeRayCastMapper()
    mapper.SetAutoAdjustSampleDistances(False)
    mapper.SetImageSampleDistance(1)
    return mapper


def main():
    scene_path, name, views, out = sys.argv[1:]
    with open(scene_path) as file:
        scene = json.load(file)
    reader = vtkXMLImageDataReader() if name in IMAGES else vtkXMLUnstructuredGridReader()
    reader.SetFileName(scene["mesh"])
    reader.Update()
    grid = reader.GetOutput()
    if name not in IMAGES and grid.GetCellType(0) != 10:
        split = vtkDataSetTriangleFilter()
        split.SetInputData(grid)
        split.Update()
        grid = split.GetOutput()
    mapper = mapper_of(name)
    mapper.SetInputData(grid)
    if scene["scalars"]["association"] == "cell":
        mapper.SetScalarModeToUseCellFieldData()
    else:
        mapper.SetScalarModeToUsePointFieldData()
    mapper.SelectScalarArray("s")
    color, opacity, prop = vtkColorTransferFunction(), vtkPiecewiseFunction(), vtkVolumeProperty()
    for knot in scene["color"]:
        color.AddRGBPoint(*knot)
    knots = np.array(scene["opacity"], float)
    if name in IMAGES:
        # The extinction's exponential, which these mappers take the logarithm of.
        places = np.union1d(np.linspace(knots[0, 0], knots[-1, 0], 2001), knots[:, 0])
        knots = np.stack([places, -np.expm1(-np.interp(places, *knots.T))], axis=1)
    for knot in knots:
        opacity.AddPoint(*knot)
    prop.SetColor(color)
    prop.SetScalarOpacity(opacity)
    prop.SetScalarOpacityUnitDistance(scene["unit_distance"])
    prop.SetInterpolationTypeToLinear()
    volume = vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(prop)
    renderer, window = vtkRenderer(), vtkRenderWindow()
    renderer.AddVolume(volume)
    renderer.SetBackground(0, 0, 0)
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.SetSize(*scene["size"])
    window.AddRenderer(renderer)
    window.SetDesiredUpdateRate(1e-4)
    camera, place = renderer.GetActiveCamera(), scene["camera"]
    camera.SetPosition(place["position"])
    camera.SetFocalPoint(place["focal_point"])
    camera.SetViewUp(place["view_up"])
    camera.SetViewAngle(place["view_angle"])
    renderer.ResetCameraClippingRange()
    # VTK 9.7's projected tetrahedra leave the first frame blank.
    window.Render()
    camera.Azimuth(1e-6)
    window.Render()
    window.WaitForCompletion()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.SetInputBufferTypeToRGB()
    grab.ReadFrontBufferOff()
    grab.ShouldRerenderOff()
    grab.Update()
    image = grab.GetOutput()
    width, height, _ = image.GetDimensions()
    np.save(out, vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, 3)[::-1] / np.float32(255))
    wall, cpu = [], []
    for _ in range(int(views)):
        camera.Azimuth(360 / int(views))
        renderer.ResetCameraClippingRange()
        start = time.perf_counter(), time.process_time()
        window.Render()
        window.WaitForCompletion()
        wall.append(time.perf_counter() - start[0])
        cpu.append(time.process_time() - start[1])
    print(json.dumps({"wall": wall, "cpu": cpu, "version": vtkVersion.GetVTKVersion()}))


main()
