# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is done again, and what is not; the object factory; progress and abort."""
import os
import re
import subprocess
import sys

import numpy as np
from scene import *  # noqa: F403
from test_pictures import RAMP, SLANT, TENT, WAVES


def test_a_still_scene_is_drawn_once():
    v = volume(lattice(2, field=SLANT), WAVES, RAMP)
    m = v.GetMapper()
    w, r = scene(v, plane(0.4, half=0.3))
    first = pixels(w)
    for _ in range(3):
        check(pixels(w), first, near=0)
    assert m.GetNumberOfFrames() == 1
    # What changes nothing that is seen changes nothing.
    v.GetProperty().SetAmbient(0.3)
    v.GetProperty().Modified()
    v.GetProperty().GetScalarOpacity().Modified()
    v.GetMapper().Modified()
    pixels(w)
    assert m.GetNumberOfFrames() == 1 and m.GetNumberOfFunctionUploads() == 1


def test_opaque_geometry_that_moves_is_seen():
    v = volume(lattice(2, field=SLANT), WAVES, RAMP)
    wall = plane(0.3)
    w, r = scene(v, wall, clip=(1, 90))
    before = pixels(w)
    wall.SetPosition(0, 0, 0.3)
    assert np.abs(pixels(w) - before).max() > 5
    assert v.GetMapper().GetNumberOfFrames() == 2 and v.GetMapper().GetNumberOfMeshUploads() == 1


def test_changed_functions_hand_over_knots_only():
    v = volume(lattice(3, field=SLANT), WAVES, RAMP)
    m = v.GetMapper()
    w, r = scene(v)
    pixels(w)
    v.GetProperty().SetScalarOpacity(opacities(TENT))
    check(pixels(w), truth(r, (64, 64), field=SLANT, opacity=TENT, color=RAMP))
    v.GetProperty().SetScalarOpacityUnitDistance(0.5)
    check(pixels(w), truth(r, (64, 64), field=SLANT, opacity=TENT, color=RAMP, unit=0.5))
    done = m.GetNumberOfFrames(), m.GetNumberOfMeshUploads(), m.GetNumberOfFieldUploads(), m.GetNumberOfFunctionUploads()
    assert done == (3, 1, 1, 3), done


def test_moved_volumes_hand_over_points_only():
    v = volume(lattice(3, field=SLANT), WAVES, RAMP)
    m = v.GetMapper()
    w, r = scene(v, clip=(1, 9))
    pixels(w)
    v.SetPosition(0.2, 0, 0.1)
    v.RotateZ(20)
    turned = rows(v.GetMatrix())
    check(pixels(w), truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP, matrix=turned))
    # A property with the same functions in it is no change.
    same = vtkRenderingCore.vtkVolumeProperty()
    same.SetColor(colors(RAMP))
    same.SetScalarOpacity(opacities(WAVES))
    same.SetScalarOpacityUnitDistance(1)
    v.SetProperty(same)
    pixels(w)
    done = (m.GetNumberOfFrames(), m.GetNumberOfMeshUploads(), m.GetNumberOfPointUploads(), m.GetNumberOfFieldUploads(),
            m.GetNumberOfFunctionUploads())
    assert done == (2, 1, 1, 1, 1), done


def test_moving_cameras_hand_over_nothing():
    v = volume(lattice(3, field=SLANT), WAVES, RAMP)
    m = v.GetMapper()
    w, r = scene(v)
    for _ in range(4):
        r.GetActiveCamera().Azimuth(10)
        w.Render()
    done = m.GetNumberOfFrames(), m.GetNumberOfMeshUploads(), m.GetNumberOfFieldUploads(), m.GetNumberOfFunctionUploads()
    assert done == (4, 1, 1, 1), done


def test_progress_and_abort():
    v = volume(lattice(32, field=SLANT), WAVES, RAMP, NumberOfThreads=1)
    shares = []
    v.GetMapper().AddObserver("VolumeMapperRenderProgressEvent", lambda *_: shares.append(1))
    # Large enough that the first report comes long before the end.
    w, r = scene(v, size=(1600, 1200))
    w.Render()
    assert shares, "a large frame says how far it is"
    tag = w.AddObserver("AbortCheckEvent", lambda *_: w.SetAbortRender(1))
    frames = v.GetMapper().GetNumberOfFrames()
    r.GetActiveCamera().Azimuth(20)
    w.Render()
    w.RemoveObserver(tag)
    assert pixels(w).max() > 100
    assert v.GetMapper().GetNumberOfFrames() == frames + 2, "what was given up is drawn the next time"


def test_print_and_settings():
    m = vtkHaliteMapper()
    m.SetDevice("cpu")
    m.SetImageSampleDistance(0.01)
    text = str(m)
    for word in ("Device: cpu", "Engine: auto", "Integral: exact", "OpacityConvention: ByInput", "ImageSampleDistance: 1"):
        assert word in text, word
    assert m.IsSupported(window()) and m.GetUseFloatingPointFrameBuffer()


def test_threads():
    """As many as the environment says, unless the mapper does; a share of the cores where a launcher started several processes."""
    share = max(1, os.cpu_count() // 2)
    for settings, asked, threads in (({"HALITE_THREADS": "3"}, 0, 3), ({"HALITE_THREADS": "3"}, 2, 2),
                                     ({"HALITE_THREADS": "3", "VTK_SMP_MAX_THREADS": "1"}, 0, 1),
                                     ({"MPI_LOCALNRANKS": "2"}, 0, min(share, len(os.sched_getaffinity(0))))):
        os.environ.update(settings)
        v = volume(lattice(2, field=SLANT), WAVES, RAMP)
        v.GetMapper().SetNumberOfThreads(asked)
        pixels(scene(v)[0])
        assert re.search(rf"\b{threads} thread", v.GetMapper().GetAdapter()), (settings, asked, v.GetMapper().GetAdapter())
        for name in settings:
            del os.environ[name]


def test_fewer_pixels_while_the_host_interacts():
    v = volume(lattice(2, field=SLANT), WAVES, RAMP)
    m = v.GetMapper()
    w, r = scene(v)
    rest = pixels(w)
    m.SetInteractiveImageSampleDistance(2)
    assert np.abs(pixels(w) - rest).max() == 0
    m.SetInteracting(True)
    coarse = pixels(w)
    m.SetInteracting(False)
    assert np.abs(coarse - rest).max() > 2 and np.abs(pixels(w) - rest).max() == 0
    m.SetImageSampleDistance(2)
    assert np.abs(pixels(w) - coarse).max() == 0


def test_rounding_up():
    v = volume(lattice(2, field=SLANT), WAVES, RAMP)
    w, r = scene(v)
    before = pixels(w)
    v.GetMapper().SetRoundingUp(True)
    more = pixels(w) - before
    assert more.min() == 0 and more.max() == 1 and 0.2 < more[before > 0].mean() < 0.8
    v.GetMapper().SetRoundingUp(False)
    assert np.abs(pixels(w) - before).max() == 0


def test_multi_block_mapper():
    from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkMultiBlockUnstructuredGridVolumeMapper
    blocks = vtkCommonDataModel.vtkMultiBlockDataSet()
    for k in range(2):
        blocks.SetBlock(k, lattice(1, low=(0, 0, k), high=(1, 1, k + 1), cells="hex", field=lambda p: p[:, 2] / 2))
    m = vtkMultiBlockUnstructuredGridVolumeMapper()
    m.SetInputDataObject(blocks)
    v = volume(lattice(), WAVES, RAMP)
    v.SetMapper(m)
    w, r = scene(v, position=(5, -4, 6), focus=(0.5, 0.5, 1), clip=(1, 20))
    check(pixels(w), truth(r, (64, 64), high=(1, 1, 2), field=lambda p: p[..., 2] / 2, opacity=WAVES, color=RAMP))


def python(code, **environment):
    """The words that a Python of its own prints."""
    run = subprocess.run([sys.executable, "-c", code], env={**os.environ, **environment}, stdout=subprocess.PIPE, check=True)
    return run.stdout.decode().split()


MAPPER = "from vtkmodules.vtkRenderingVolume import vtkProjectedTetrahedraMapper as M; "
OPENGL = "import vtkmodules.vtkRenderingVolumeOpenGL2; "
MADE = "print(M().GetClassName()); "


def test_import_before_and_after_vtk():
    assert python("import halite; " + OPENGL + MAPPER + MADE) == ["vtkHaliteMapper"]
    assert python(OPENGL + MAPPER + MADE + "import halite; " + MADE) == ["vtkOpenGLProjectedTetrahedraMapper", "vtkHaliteMapper"]


def test_autoload():
    folder = os.environ["HALITE_AUTOLOAD"]
    assert python(OPENGL + MAPPER + MADE, VTK_AUTOLOAD_PATH=folder) == ["vtkHaliteMapper"]
    both = python(OPENGL + MAPPER + MADE + "import halite; " + MADE, VTK_AUTOLOAD_PATH=folder)
    assert both == ["vtkHaliteMapper"] * 2


def test_opting_out():
    theirs = ["vtkOpenGLProjectedTetrahedraMapper"]
    off = "from halite.vtkHalite import vtkHaliteMapper as H; H.SetOverride(False); "
    assert python(OPENGL + MAPPER + off + MADE) == theirs
    assert python(off + OPENGL + MAPPER + MADE) == theirs
    assert python("import halite; " + OPENGL + MAPPER + MADE, HALITE_OVERRIDE="0") == theirs
    folder = os.environ["HALITE_AUTOLOAD"]
    assert python(OPENGL + MAPPER + MADE, HALITE_OVERRIDE="0", VTK_AUTOLOAD_PATH=folder) == theirs
    assert python(OPENGL + MAPPER + off + "H.SetOverride(True); " + MADE) == ["vtkHaliteMapper"]


if __name__ == "__main__":
    main(globals())
