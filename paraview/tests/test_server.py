# SPDX-License-Identifier: MIT OR Apache-2.0
"""A server that renders, with this process as its client. Arguments: pvserver, and what it is started with (mpiexec ...)."""
import socket
import subprocess
import sys
import tempfile
import time

import session

from paraview import servermanager, simple
from vtkmodules import vtkIOXML

from boxes import check as near, lattice
from runner import main
from test_parallel import ABOUT, COLOR, OPACITY, drawn


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def listens(port):
    with open("/proc/net/tcp") as f:
        return any(f"{port:04X}" == line.split()[1].split(":")[1] and line.split()[3] == "0A" for line in list(f)[1:])


def test_the_server_draws():
    def check(v):
        assert v.GetClientSideObject().GetUseDistributedRenderingForRender()

    assert servermanager.ActiveConnection.IsRemote()
    drawn([0, 0.125, 0.25, 0.5, 1], also=check)


def test_time_on_the_server():
    steps = [lattice(3, cells="mixed", field=lambda p, k=k: p[:, 2] * (1 - 0.2 * k)) for k in range(3)]
    with tempfile.TemporaryDirectory() as folder:
        v = session.view()
        reader = session.series(folder, vtkIOXML.vtkXMLUnstructuredGridWriter, "vtu", steps)
        session.show(reader, v, color=COLOR, opacity=OPACITY)
        for k in (0, 2, 1):
            v.ViewTime = k
            near(session.picture(v), session.truth(v, field=lambda q: q[..., 2] * (1 - 0.2 * k), **ABOUT), what=f"step {k}")
        simple.Delete(reader)
        simple.Delete(v)


if __name__ == "__main__":
    port = free_port()
    command = sys.argv[1:] + [f"--server-port={port}"]
    del sys.argv[1:]
    server = subprocess.Popen(command)
    try:
        until = time.monotonic() + 60
        # A connection to ask would be the client's.
        while not listens(port) and time.monotonic() < until and server.poll() is None:
            time.sleep(0.1)
        simple.Connect("localhost", port)
        session.load()
        main(dict(globals()))
        simple.Disconnect()
    finally:
        # It would wait until this process ends.
        server.kill()
        server.wait()
