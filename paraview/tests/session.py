# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the tests in ParaView share: views, displays with Halite, and their pictures."""
import os
import re
import sys

import numpy as np
from paraview import servermanager, simple
from vtkmodules import vtkRenderingCore
from vtkmodules.util import numpy_support

sys.path.append(os.environ["HALITE_TESTS"])

SIZE = (96, 80)


def load():
    """Loads the plugin into this process, and into the server if there is one."""
    plugin = os.environ["HALITE_PLUGIN"]
    # The first picture would have a camera of its own.
    simple._DisableFirstRenderCameraReset()
    simple.LoadPlugin(plugin, remote=False, ns=globals())
    if servermanager.ActiveConnection.IsRemote():
        simple.LoadPlugin(plugin, remote=True, ns=globals())


def view(position=(2.1, -1.7, 2.9), focus=(0.5, 0.5, 0.5), up=(0, 0, 1), angle=30, size=SIZE):
    """A view of nothing but what is shown, on black."""
    v = simple.CreateView("RenderView")
    v.ViewSize = size
    v.OrientationAxesVisibility = 0
    v.UseColorPaletteForBackground = 0
    v.Background = [0, 0, 0]
    v.CameraPosition, v.CameraFocalPoint, v.CameraViewUp, v.CameraViewAngle = position, focus, up, angle
    v.CenterAxesVisibility = 0
    # On several ranks this smooths the whole picture, volumes too.
    v.UseFXAA = 0
    return v


def source(data):
    """A source that produces a data object of this process."""
    s = simple.TrivialProducer()
    s.GetClientSideObject().SetOutput(data)
    s.UpdatePipeline()
    return s


def series(folder, writer, ending, steps):
    """A reader of these data objects as steps at times 0, 1, ..., each a file of its own in the folder."""
    with open(os.path.join(folder, "series.pvd"), "w") as f:
        f.write('<VTKFile type="Collection" version="0.1"><Collection>')
        for k, data in enumerate(steps):
            w = writer()
            w.SetFileName(os.path.join(folder, f"{k}.{ending}"))
            w.SetInputData(data)
            w.Write()
            f.write(f'<DataSet timestep="{k}" file="{k}.{ending}"/>')
        f.write("</Collection></VTKFile>")
    return simple.PVDReader(FileName=os.path.join(folder, "series.pvd"))


def show(producer, v, array=("POINTS", "s"), color=((0, 1, 1, 1),), opacity=((0, 1),), unit=1.0, mapper="Halite",
         representation=None):
    """Shows a source as a volume."""
    d = simple.Show(producer, v, *([representation] if representation else []))
    d.SetRepresentationType("Volume")
    d.ColorArrayName = array
    d.LookupTable = simple.CreateLookupTable(
        RGBPoints=[x for k in color for x in k], ColorSpace="RGB", ScalarRangeInitialized=1)
    d.ScalarOpacityFunction = simple.CreatePiecewiseFunction(
        Points=[x for s, a in opacity for x in (s, a, 0.5, 0)], ScalarRangeInitialized=1)
    d.ScalarOpacityUnitDistance = unit
    if mapper:
        d.SelectMapper = mapper
    return d


def picture(v):
    """What a view shows, as (h, w, 3) numbers from 0 to 255; row 0 is the lowest."""
    simple.Render(v)
    image = v.SMProxy.CaptureWindow(1)
    w, h, _ = image.GetDimensions()
    return numpy_support.vtk_to_numpy(image.GetPointData().GetScalars()).reshape(h, w, -1)[..., :3].astype(int)


def window(v):
    """What the view's window shows now, as `picture` has it, without drawing it anew."""
    grab = vtkRenderingCore.vtkWindowToImageFilter()
    grab.SetInput(v.SMProxy.GetRenderWindow())
    grab.ShouldRerenderOff()
    grab.ReadFrontBufferOff()
    grab.Update()
    image = grab.GetOutput()
    w, h, _ = image.GetDimensions()
    return numpy_support.vtk_to_numpy(image.GetPointData().GetScalars()).reshape(h, w, -1)[..., :3].astype(int)


def mapper_of(display):
    """The mapper that drew last behind a display of this process."""
    return display.GetClientSideObject().GetActiveRepresentation().GetActor().GetMapper()


def count(display, what):
    """How often the mapper did something: NumberOf*, as vtkHaliteMapper prints it. Python knows that class as its base only."""
    return int(re.search(rf"NumberOf{what}: (\d+)", str(mapper_of(display))).group(1))


def truth(v, size=SIZE, **about):
    """The picture of a box as `boxes.truth` has it, over black, without its opacity."""
    import boxes
    return boxes.truth(v.SMProxy.GetRenderer(), size, **about)[..., :3]


def apart(a, b):
    return np.abs(np.asarray(a, float) - b).max()
