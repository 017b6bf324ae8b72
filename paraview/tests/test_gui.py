# SPDX-License-Identifier: MIT OR Apache-2.0
"""ParaView's own window, on a display of its own: the plugin is found, Halite is in the list, and the picture is in the view.

Arguments: paraview, Xvfb.
"""
import json
import os
import struct
import subprocess
import sys
import tempfile
import time

import session

import numpy as np
from paraview import simple
from vtkmodules import vtkIOXML

from boxes import check, lattice
from runner import main
from test_pictures import ABOUT, COLOR, OPACITY

SCREEN = (1280, 1024)
PARAVIEW, XVFB = sys.argv[1:3]
del sys.argv[1:3]

# What the window does when it is there: it opens the state, and writes what it finds.
SCRIPT = """
import json, traceback
from paraview import simple
try:
    simple.LoadState({state!r})
    view, source = simple.GetActiveView(), list(simple.GetSources().values())[0]
    simple.SetActiveSource(source)
    display = simple.GetDisplayProperties(source, view)
    simple._DisableFirstRenderCameraReset()
    simple.Render(view)
    mapper = display.GetProperty("SelectMapper")
    found = dict(size=list(view.ViewSize), list=list(mapper.GetAvailable()), chosen=mapper.GetData())
except BaseException:
    found = dict(error=traceback.format_exc())
with open({found!r} + ".part", "w") as f:
    json.dump(found, f)
import os
os.rename({found!r} + ".part", {found!r})
"""


def screen(folder):
    """What the display shows, as (h, w, 3) numbers; row 0 is the lowest. Xvfb keeps it in a file in the format of xwd."""
    with open(os.path.join(folder, "Xvfb_screen0"), "rb") as f:
        data = f.read()
    head = struct.unpack(">25I", data[:100])
    size, width, height, stride, colors = head[0], head[4], head[5], head[12], head[19]
    rows = np.frombuffer(data, np.uint8, height * stride, size + 12 * colors).reshape(height, stride)
    return rows[::-1, : 4 * width].reshape(height, width, 4)[..., 2::-1].astype(int)


def place(picture, window):
    """Where a picture is in a window: the offset of its lowest left pixel at which 400 of its pixels are nearest."""
    h, w, _ = picture.shape
    random = np.random.default_rng(1)
    y, x = random.integers(0, h, 400), random.integers(0, w, 400)
    across, up = window.shape[1] - w + 1, window.shape[0] - h + 1
    apart = sum(np.abs(window[j : j + up, i : i + across] - picture[j, i]).sum(-1) for j, i in zip(y, x))
    return np.unravel_index(np.argmin(apart), apart.shape)


def test_the_window():
    with tempfile.TemporaryDirectory() as folder:
        state, mesh = os.path.join(folder, "state.pvsm"), os.path.join(folder, "mesh.vtu")
        w = vtkIOXML.vtkXMLUnstructuredGridWriter()
        w.SetFileName(mesh)
        w.SetInputData(lattice(3, cells="mixed"))
        w.Write()
        v = session.view()
        d = simple.Show(simple.XMLUnstructuredGridReader(FileName=[mesh]), v)
        d.SetRepresentationType("Volume")
        simple.ColorBy(d, ("POINTS", "s"))
        # The colour map editor wants functions that belong to an array.
        colors, opacities = simple.GetColorTransferFunction("s"), simple.GetOpacityTransferFunction("s")
        colors.RGBPoints, colors.ColorSpace = [x for k in COLOR for x in k], "RGB"
        opacities.Points = [x for s, a in OPACITY for x in (s, a, 0.5, 0)]
        d.ScalarOpacityUnitDistance, d.SelectMapper = 1, "Halite"
        d.SetScalarBarVisibility(v, False)
        check(session.picture(v), session.truth(v, **ABOUT))
        simple.AssignViewToLayout(v, simple.CreateLayout("Layout"))
        simple.SaveState(state)

        found = os.path.join(folder, "found.json")
        with open(os.path.join(folder, "script.py"), "w") as f:
            f.write(SCRIPT.format(state=state, found=found))
        settings = os.path.join(folder, ".config", "ParaView")
        os.makedirs(settings)
        # In a name, the version of ParaView that reads it: its greeting would cover the view.
        with open(os.path.join(settings, f"ParaView{simple.GetParaViewSourceVersion().split()[-1]}.ini"), "w") as f:
            f.write("[General]\nGeneralSettings.ShowWelcomeDialog=false\n")
        running = []
        try:
            read, write = os.pipe()
            running.append(subprocess.Popen(
                [XVFB, "-displayfd", str(write), "-screen", "0", f"{SCREEN[0]}x{SCREEN[1]}x24", "-noreset", "-fbdir", folder],
                pass_fds=[write], stderr=subprocess.DEVNULL))
            os.close(write)
            with os.fdopen(read) as f:
                number = f.readline().strip()
            environment = dict(os.environ, DISPLAY=f":{number}", HOME=folder, XDG_CONFIG_HOME=os.path.join(folder, ".config"),
                               PV_PLUGIN_PATH=os.path.dirname(os.environ["HALITE_PLUGIN"]))
            running.append(subprocess.Popen([PARAVIEW, f"--script={folder}/script.py"], env=environment, cwd=folder))
            until = time.monotonic() + 40
            while not os.path.exists(found):
                assert running[-1].poll() is None, "ParaView's window is gone"
                assert time.monotonic() < until, "ParaView's window opens no state"
                time.sleep(0.2)
            with open(found) as f:
                about = json.load(f)
            assert "error" not in about, about["error"]
            assert about["list"][-1] == "Halite" and "Projected tetra" in about["list"] and about["chosen"] == "Halite", about
            v.ViewSize = about["size"]
            expected = session.picture(v)
            assert expected.max() > 100
            # It draws when it has laid out itself.
            at = apart = None
            while time.monotonic() < until:
                shown = screen(folder)
                at = place(expected, shown)
                apart = np.abs(shown[at[0]:, at[1]:][: expected.shape[0], : expected.shape[1]] - expected).max(-1)
                # The pointer is in the middle of the screen.
                y, x = SCREEN[1] // 2 - at[0], SCREEN[0] // 2 - at[1]
                apart[max(y - 24, 0) : max(y + 24, 0), max(x - 24, 0) : max(x + 24, 0)] = 0
                # And the window may frame its view.
                if apart[2:-2, 2:-2].max() <= 2:
                    break
                time.sleep(1)
            print(f"        the view of {about['size']} pixels, {apart[2:-2, 2:-2].max()} of 255 apart at most")
            for name, picture in (("expected", expected), ("screen", shown)):
                np.save(os.path.join(os.environ["HALITE_TEST_OUTPUT"], f"gui_{name}.npy"), picture.astype(np.uint8))
            assert apart[2:-2, 2:-2].max() <= 2, (at, (apart > 2).sum())
        finally:
            for process in reversed(running):
                process.kill()
                process.wait()


if __name__ == "__main__":
    session.load()
    main(dict(globals()))
