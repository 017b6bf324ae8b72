# SPDX-License-Identifier: MIT OR Apache-2.0
"""What observers may do in the middle of a frame: anything that VTK itself survives. Afterwards pictures are right, in every
window."""
import gc

import numpy as np
from scene import *  # noqa: F403
from test_pictures import RAMP, SLANT, WAVES

# Large enough for events, three times at least: the first comes 20 ms after a frame has begun.
SIZE = 640


class Stage:
    """One mapper and volume in two windows."""

    def __init__(self, walls=True):
        self.walls = lambda: [plane(-0.4, (0.2, 0.4, 0.6))] if walls else []
        self.grid = lattice(12, field=SLANT)
        self.volume = volume(self.grid, WAVES, RAMP, NumberOfThreads=1)
        self.mapper = self.volume.GetMapper()
        self.windows, self.renderers = zip(*[scene(self.volume, *self.walls(), size=(SIZE, SIZE), position=p, clip=(0.5, 12))
                                             for p in ((2.1, -1.7, 2.9), (-2, -3, 1))])
        for w in self.windows:
            w.SetOffScreenRendering(1)
        self.said = Errors(self.mapper)
        self.calls = 0

    def observe(self, act, event="VolumeMapperRenderProgressEvent", of=None):
        """Draws the first window, and acts in that frame, once. The mapper is not held meanwhile."""
        of = of or self.mapper

        def observer(*_):
            self.calls += 1
            if self.calls == 1:
                act(self)

        tag = of.AddObserver(event, observer)
        del of
        self.windows[0].Render()
        assert self.calls, "nothing was observed"
        if self.mapper:
            self.mapper.RemoveObserver(tag)

    def expected(self):
        """What another mapper, that saw nothing of this, draws of the same."""
        v = vtkRenderingCore.vtkVolume()
        m = vtkHaliteMapper()
        m.SetInputData(self.mapper.GetInput())
        v.SetMapper(m)
        v.SetProperty(self.volume.GetProperty())
        pictures = []
        for w, r in zip(self.windows, self.renderers):
            fresh = window(w.GetSize())
            fresh.SetOffScreenRendering(1)
            other = renderer(fresh, v, *self.walls())
            other.SetActiveCamera(r.GetActiveCamera())
            pictures.append(pixels(fresh))
        return pictures

    def check(self, what):
        expected = self.expected()
        # Each window twice: a picture that was kept must be right too.
        for k in (1, 0, 1, 0):
            check(pixels(self.windows[k]), expected[k], near=0, what=f"{what}, window {k}")


def render_other(s):
    s.windows[1].Render()


def render_self(s):
    s.windows[0].Render()


def direct(s):
    s.mapper.Render(s.renderers[0], s.volume)
    s.mapper.Render(s.renderers[1], s.volume)


def release(s):
    s.mapper.ReleaseGraphicsResources(s.windows[0])


def release_both(s):
    release(s)
    s.mapper.ReleaseGraphicsResources(s.windows[1])
    s.mapper.ReleaseGraphicsResources(None)


def remove(s):
    s.renderers[0].RemoveVolume(s.volume)
    s.renderers[0].AddVolume(s.volume)


def finalize(s):
    s.windows[0].Finalize()


def finalize_after_other(s):
    s.windows[1].Render()
    s.windows[0].Finalize()


def finalize_other(s):
    s.windows[1].Finalize()


def remove_renderer(s):
    s.windows[0].RemoveRenderer(s.renderers[0])


def move_renderer(s):
    """Into the other window, and back when the frame is over."""
    remove_renderer(s)
    s.windows[1].AddRenderer(s.renderers[0])


def put_back(s):
    for w, r in zip(s.windows, s.renderers):
        for other in s.windows:
            if other is not w:
                other.RemoveRenderer(r)
        if not w.HasRenderer(r):
            w.AddRenderer(r)


def resize(s):
    s.windows[0].SetSize(200, 150)


def another_mapper(s):
    w, r = scene(volume(s.grid, WAVES, RAMP), size=(60, 60))
    assert pixels(w).max() > 50


def new_input(s):
    s.mapper.SetInputData(lattice(2, cells="tet", field=SLANT))


def edit_data(s):
    values = numpy_support.vtk_to_numpy(s.grid.GetPointData().GetScalars())
    values[:] = values[::-1].copy()
    s.grid.GetPointData().GetScalars().Modified()


def edit_function(s):
    s.volume.GetProperty().GetScalarOpacity().AddPoint(0.5, 2)


def settings(s):
    s.mapper.SetNumberOfThreads(2)
    s.mapper.SetDevice("cpu")
    s.mapper.SetIntegralToPolynomial()
    s.mapper.SetIntegralToExact()


def ask(s):
    assert s.mapper.GetNumberOfTetrahedra() >= 0 and s.mapper.GetAdapter() is not None and "vtkHaliteMapper" in str(s.mapper)


def raise_an_error(s):
    raise RuntimeError("an observer raises this; it is printed, and ends nothing")


def abort(s):
    s.windows[0].SetAbortRender(1)


ACTIONS = (render_other, render_self, direct, release, release_both, remove, finalize, finalize_after_other, finalize_other, resize,
           remove_renderer, move_renderer, another_mapper, new_input, edit_data, edit_function, settings, ask, raise_an_error, abort)


def test_actions_in_a_frame():
    for act in ACTIONS:
        s = Stage()
        s.observe(act)
        put_back(s)
        s.check(act.__name__)


def test_a_renderer_stays_where_observers_put_it():
    s = Stage()
    s.observe(remove_renderer)
    assert not s.windows[0].HasRenderer(s.renderers[0]) and s.renderers[0].GetRenderWindow() is None
    s = Stage()
    s.observe(move_renderer)
    assert not s.windows[0].HasRenderer(s.renderers[0]) and s.renderers[0].GetRenderWindow() is s.windows[1]


def test_actions_when_another_window_is_known():
    for act in (render_other, release_both, finalize, finalize_other):
        s = Stage()
        s.check("before")
        for r in s.renderers:
            r.GetActiveCamera().Azimuth(10)
        s.observe(act)
        s.check(act.__name__)


def test_actions_in_abort_checks():
    # VTK's mapper of surfaces asks too, and does not survive that its window is finalized.
    for act in (render_other, release, finalize, remove, remove_renderer):
        for walls in (False, True) if act in (render_other, release, remove) else (False,):
            s = Stage(walls)
            s.observe(act, "AbortCheckEvent", s.windows[0])
            s.windows[0].RemoveObservers("AbortCheckEvent")
            put_back(s)
            s.check(f"{act.__name__}, walls {walls}")


def test_a_frame_in_a_frame_is_refused_in_its_own_words():
    s = Stage()
    warnings, errors = messages(s.mapper, "WarningEvent"), messages(s.mapper)
    for _ in range(2):
        s.calls = 0
        s.observe(render_other)
        s.renderers[0].GetActiveCamera().Azimuth(5)
    said = warnings + errors
    assert len(said) == 1 and "drawing a frame" in said[0] and "failed" not in said[0], said


def test_everything_goes_in_a_frame():
    def go(s):
        for r in s.renderers:
            r.RemoveVolume(s.volume)
        s.volume.SetMapper(None)
        s.volume = s.mapper = s.said = None
        gc.collect()

    s = Stage()
    gone = []
    for o in (s.mapper, s.volume):
        o.AddObserver("DeleteEvent", lambda *_: gone.append(1))
    del o
    s.observe(go)
    gc.collect()
    assert len(gone) == 2, "what nobody holds is gone when the frame is over"
    blank = pixels(s.windows[0])
    assert (blank == pixels(s.windows[0])).all() and blank[..., 0].max() <= 51


def test_a_volume_that_loses_its_mapper_in_a_frame_stays_without():
    s = Stage()
    s.observe(lambda s: s.volume.SetMapper(None))
    assert s.volume.GetMapper() is None
    s.windows[0].Render()
    s.volume.SetMapper(s.mapper)
    s.check("with its mapper again")


def test_other_props_go_in_a_frame():
    s = Stage()
    s.renderers[0].AddVolume(volume(lattice(1, low=(2, 2, 2), high=(3, 3, 3)), WAVES))
    s.observe(lambda s: s.renderers[0].RemoveAllViewProps())
    gc.collect()
    assert pixels(s.windows[0])[..., :3].max() == 0
    for p in (s.volume, plane(-0.4, (0.2, 0.4, 0.6))):
        s.renderers[0].AddViewProp(p)
    s.check("with props again")


def test_depth_peeling_is_survived_too():
    for act in ACTIONS:
        s = Stage()
        sheet = plane(0.4, (0.9, 0.3, 0.1))
        sheet.GetProperty().SetOpacity(0.5)
        r = s.renderers[0]
        r.AddViewProp(sheet)
        r.UseDepthPeelingOn()
        r.UseDepthPeelingForVolumesOn()
        s.observe(act)
        put_back(s)
        r.RemoveViewProp(sheet)
        s.check(act.__name__ + " while peeling")


if __name__ == "__main__":
    main(globals())
