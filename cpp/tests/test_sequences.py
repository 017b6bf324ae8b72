# SPDX-License-Identifier: MIT OR Apache-2.0
"""Random sequences of what programs call, by fixed seeds: whatever came before, two windows show what a mapper that is new
draws of the same."""
import os
import random

import numpy as np
from scene import *  # noqa: F403
from test_pictures import RAMP, SLANT, TENT, WAVES

SIZE = (72, 56)
GRIDS = {
    "tets": lambda: lattice(4, cells="tet", field=SLANT),
    "mixed": lambda: lattice(3, cells="mixed", field=SLANT),
    "bytes": lambda: lattice(2, field=lambda p: (255 * SLANT(p)).astype(np.uint8)),
    "cells": lambda: add_cells(lattice(2)),
    "vectors": lambda: lattice(2, field=lambda p: np.stack([SLANT(p), 1 - SLANT(p)], -1)),
    "broken": lambda: broken(lattice(3, field=SLANT)),
    "empty": lambda: grid(np.zeros((0, 3)), []),
    "surface": lambda: grid([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [(QUAD, [0, 1, 2, 3])], np.zeros(4)),
    "short": lambda: short(lattice(1)),
}


def add_cells(g):
    g.GetPointData().Initialize()
    add(g, np.linspace(0, 1, g.GetNumberOfCells()), "s", "cell")
    return g


def broken(g):
    g.GetPoints().SetPoint(0, 0, np.nan, 0)
    return g


def short(g):
    g.GetPointData().Initialize()
    add(g, np.zeros(3))
    return g


class Program:
    """What a program has, and what it does at random."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.volume = volume(lattice(4, cells="tet", field=SLANT), WAVES, RAMP)
        self.mapper = self.volume.GetMapper()
        self.errors = Errors(self.mapper)
        self.windows, self.renderers = [], []
        for k in range(2):
            w, r = scene(self.volume, size=SIZE, position=((2.1, -1.7, 2.9), (-2, -3, 1))[k], clip=(0.2, 30))
            w.SetOffScreenRendering(1)
            self.windows.append(w)
            self.renderers.append(r)
        self.sheet, self.wall = plane(0.4, (0.9, 0.3, 0.1), half=1.0), plane(-0.3, (0.2, 0.4, 0.6))
        self.sheet.GetProperty().SetOpacity(0.5)
        self.done = []

    def one(self, choices):
        return self.random.choice(list(choices))

    # What may happen; `k` is one of the two windows.
    def render(self, k): self.windows[k].Render()

    def direct(self, k): self.mapper.Render(self.renderers[k], self.volume)

    def release(self, k): self.mapper.ReleaseGraphicsResources(self.windows[k])

    def release_none(self, k): self.mapper.ReleaseGraphicsResources(None)

    def finalize(self, k): self.windows[k].Finalize()

    def resize(self, k): self.windows[k].SetSize(self.one((40, 72, 73)), self.one((31, 56)))

    def grid(self, k): self.mapper.SetInputData(GRIDS[self.one(GRIDS)]())

    def same_grid(self, k): self.mapper.SetInputData(GRIDS["tets"]())

    def values(self, k):
        a = self.mapper.GetInput().GetPointData().GetScalars()
        if a and a.GetNumberOfValues():
            v = numpy_support.vtk_to_numpy(a)
            v[:] = v[::-1].copy()
            a.Modified()

    def points(self, k):
        p = self.mapper.GetInput().GetPoints()
        if p and p.GetNumberOfPoints():
            p.SetPoint(0, 0, self.one((np.nan, 0, -0.1)), 0)
            p.Modified()

    def function(self, k): self.volume.GetProperty().SetScalarOpacity(opacities(self.one((WAVES, TENT, [(0, 0.4)], [(0, 0), (1, 0)]))))

    def edit(self, k): self.volume.GetProperty().GetScalarOpacity().AddPoint(self.random.random(), self.random.random())

    def unit(self, k): self.volume.GetProperty().SetScalarOpacityUnitDistance(self.one((0.2, 1, 3)))

    def components(self, k): self.volume.GetProperty().SetIndependentComponents(self.one((0, 1)))

    def move(self, k): self.volume.SetPosition(self.one((0, 0.3)), 0, self.one((0, -0.2)))

    def scale(self, k): self.volume.SetScale(self.one((1, -1, 0.6)), 1, 1)

    def camera(self, k): self.renderers[k].GetActiveCamera().Azimuth(self.one((7, -20)))

    def projection(self, k): self.renderers[k].GetActiveCamera().SetParallelProjection(self.one((0, 1)))

    def blend(self, k): self.mapper.SetBlendMode(self.one((0, 0, 1, 4)))

    def distance(self, k): self.mapper.SetImageSampleDistance(self.one((1, 2)))

    def integral(self, k):
        """Some have a table that cannot be."""
        m = self.mapper
        m.SetIntegral(self.one((m.EXACT, m.EXACT, m.VOLUME, m.AUTO_INTEGRAL)))
        m.SetTableSize((1, 1, 1) if m.GetIntegral() == m.VOLUME else (0, 0, 0))

    def unused(self, k): self.mapper.SetPolynomialDegree(self.one((2, 99)))

    def threads(self, k): self.mapper.SetNumberOfThreads(self.one((0, 1, 2)))

    def visible(self, k): self.volume.SetVisibility(self.one((0, 1, 1)))

    def remove(self, k): self.renderers[k].RemoveVolume(self.volume)

    def add(self, k): self.renderers[k].AddVolume(self.volume)

    def surfaces(self, k):
        for p in (self.sheet, self.wall):
            self.renderers[k].RemoveViewProp(p)
            if self.one((0, 1)):
                self.renderers[k].AddViewProp(p)

    def peel(self, k):
        self.renderers[k].SetUseDepthPeeling(self.one((0, 1)))
        self.renderers[k].SetUseDepthPeelingForVolumes(self.one((0, 1)))

    def clip(self, k):
        self.mapper.RemoveAllClippingPlanes()
        if self.one((0, 1)):
            p = vtkCommonDataModel.vtkPlane()
            p.SetOrigin(0.5, 0.5, 0.5)
            p.SetNormal(1, 0.3, 0.2)
            self.mapper.AddClippingPlane(p)

    def samples(self, k):
        self.windows[k].SetMultiSamples(self.one((0, 4)))

    def abort(self, k):
        w = self.windows[k]
        tag = w.AddObserver("AbortCheckEvent", lambda *_: w.SetAbortRender(1))
        w.Render()
        w.RemoveObserver(tag)

    def nested(self, k):
        """Some of this in the middle of a frame, which is made long enough for that."""
        acts = [self.one(self.acts()) for _ in range(2)]
        self.done.append([a.__name__ for a in acts])

        def observer(*_):
            self.mapper.RemoveObservers("VolumeMapperRenderProgressEvent")
            for act in acts:
                act(self.one((0, 1)))

        self.mapper.AddObserver("VolumeMapperRenderProgressEvent", observer)
        self.mapper.SetInputData(lattice(8, field=SLANT))
        size = self.windows[k].GetSize()
        self.windows[k].SetSize(260, 260)
        self.windows[k].Render()
        self.mapper.RemoveObservers("VolumeMapperRenderProgressEvent")
        self.windows[k].SetSize(*size)

    def acts(self):
        return [self.render, self.direct, self.release, self.release_none, self.finalize, self.resize, self.grid, self.same_grid,
                self.values, self.points, self.function, self.edit, self.unit, self.components, self.move, self.scale, self.camera,
                self.projection, self.blend, self.distance, self.integral, self.unused, self.threads, self.visible, self.remove,
                self.add, self.surfaces, self.peel, self.clip, self.samples, self.abort]

    def go(self, steps):
        for _ in range(steps):
            act = self.one(self.acts() + 3 * [self.render] + [self.nested])
            self.done.append(act.__name__)
            act(self.one((0, 1)))

    def fresh(self, k):
        """What a mapper of its own draws of what the program has now."""
        m = vtkHaliteMapper()
        m.SetInputData(self.mapper.GetInput())
        for name in ("Integral", "BlendMode", "ImageSampleDistance", "PolynomialDegree", "TableSize"):
            getattr(m, "Set" + name)(getattr(self.mapper, "Get" + name)())
        if self.mapper.GetClippingPlanes():
            m.SetClippingPlanes(self.mapper.GetClippingPlanes())
        said = Errors(m)
        v = vtkRenderingCore.vtkVolume()
        v.SetMapper(m)
        v.SetProperty(self.volume.GetProperty())
        for name in ("Position", "Scale", "Visibility"):
            getattr(v, "Set" + name)(getattr(self.volume, "Get" + name)())
        of = self.renderers[k]
        w = window(self.windows[k].GetSize(), self.windows[k].GetMultiSamples())
        w.SetOffScreenRendering(1)
        r = renderer(w)
        for i in range(of.GetViewProps().GetNumberOfItems()):
            p = of.GetViewProps().GetItemAsObject(i)
            r.AddViewProp(v if p is self.volume else p)
        r.SetActiveCamera(of.GetActiveCamera())
        r.SetUseDepthPeeling(of.GetUseDepthPeeling())
        r.SetUseDepthPeelingForVolumes(of.GetUseDepthPeelingForVolumes())
        picture = pixels(w)
        w.Finalize()
        del said
        return picture


def test_sequences():
    first, count = (int(os.environ.get(n, d)) for n, d in (("HALITE_FIRST_SEED", "1"), ("HALITE_SEEDS", "16")))
    seen = 0
    for seed in range(first, first + count):
        p = Program(seed)
        for _ in range(2):
            p.go(8)
            for k in (0, 1):
                expected = p.fresh(k)
                for time in ("then", "again"):
                    apart = np.abs(pixels(p.windows[k]) - expected).max()
                    assert apart <= 1, (seed, k, time, apart, p.done)
                seen += expected[..., :3].max() > 20
    assert seen > count, "most pictures show something"


if __name__ == "__main__":
    main(globals())
