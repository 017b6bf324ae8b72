# SPDX-License-Identifier: MIT OR Apache-2.0
"""A volume of tetrahedra, an opaque slice through it and its colour bar, in ParaView: pvbatch picture.py HALITE.SO PICTURE.png"""
import sys

from paraview import simple

plugin, picture = sys.argv[1:3]
simple._DisableFirstRenderCameraReset()
simple.LoadPlugin(plugin, remote=False, ns=globals())

view = simple.CreateView("RenderView")
view.ViewSize, view.OrientationAxesVisibility = [540, 400], 0
view.UseColorPaletteForBackground, view.Background = 0, [0.07, 0.08, 0.1]
view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = [46, -66, 34], [3, 0, -3], [0, 0, 1]

wavelet = simple.Wavelet(WholeExtent=[-16, 16] * 3)
tetrahedra = simple.Tetrahedralize(Input=wavelet)
volume = simple.Show(tetrahedra, view)
volume.SetRepresentationType("Volume")
volume.SelectMapper = "Halite"
simple.ColorBy(volume, ("POINTS", "RTData"))
colors, opacities = simple.GetColorTransferFunction("RTData"), simple.GetOpacityTransferFunction("RTData")
colors.ApplyPreset("Turbo", True)
# Two shells with nothing between them, thin enough that the mappers that look at vertices miss them.
shells = [(30, 0), (128, 0), (130, 1.4), (132, 0), (205, 0), (208, 4), (211, 0), (280, 0)]
opacities.Points = [x for s, a in shells for x in (s, a, 0.5, 0)]
volume.ScalarOpacityUnitDistance = 1.5

plane = simple.Slice(Input=wavelet)
plane.SliceType.Origin, plane.SliceType.Normal = [0, 0, -15], [0, 0, 1]
surface = simple.Show(plane, view)
simple.ColorBy(surface, ("POINTS", "RTData"))
colors.RescaleTransferFunction(60, 230)
surface.Ambient, surface.Diffuse, surface.Specular = 0.6, 0.4, 0

bar = simple.GetScalarBar(colors, view)
bar.Title, bar.ComponentTitle, bar.ScalarBarLength = "RTData", "", 0.6
volume.SetScalarBarVisibility(view, True)
simple.SaveScreenshot(picture, view, ImageResolution=view.ViewSize)
