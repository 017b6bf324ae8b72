# SPDX-License-Identifier: MIT OR Apache-2.0
"""A view of trame that the server draws, as a browser sees it: over its websocket."""
import asyncio
import io
import warnings

import numpy as np
import pytest

pytest.importorskip("trame_pyvista")
pytest.importorskip("trame_vtk")
pytest.importorskip("trame_vuetify")

import aiohttp  # noqa: E402
import msgpack  # noqa: E402
from PIL import Image  # noqa: E402
from trame.app import get_server  # noqa: E402
from trame.ui.vuetify3 import SinglePageLayout  # noqa: E402
from trame_pyvista.ui import plotter_ui  # noqa: E402
from wslink.chunking import UnChunker, generate_chunks  # noqa: E402

from test_plotters import box, look, truth  # noqa: E402
from windows import SIZE  # noqa: E402

_LARGE = 1 << 28


class Browser:
    """What trame's client does: calls, and pictures that come."""

    def __init__(self, socket):
        self.socket, self.number, self.pictures = socket, 0, []
        self.chunks = UnChunker()
        self.chunks.set_max_message_size(_LARGE)

    async def receive(self, seconds):
        message = self.chunks.process_chunk((await asyncio.wait_for(self.socket.receive(), seconds)).data)
        if message and str(message.get("id", "")).startswith("publish:viewport.image") and message["result"].get("image"):
            picture = Image.open(io.BytesIO(message["result"]["image"])).convert("RGB")
            self.pictures.append(np.asarray(picture, float))
        return message

    async def call(self, method, *arguments):
        self.number += 1
        identity = f"rpc:c0:{self.number}" if self.number > 1 else "system:c0:0"
        call = {"wslink": "1.0", "id": identity, "method": method, "args": list(arguments), "kwargs": {}}
        for chunk in generate_chunks(msgpack.packb(call), _LARGE):
            await self.socket.send_bytes(chunk)
        while True:
            answer = await self.receive(20)
            if answer and answer.get("id") == identity:
                assert "error" not in answer, answer
                return answer["result"]

    async def last_picture(self):
        """The last one that comes before it is quiet for a second."""
        self.pictures.clear()
        try:
            while True:
                await self.receive(1)
        except asyncio.TimeoutError:
            return self.pictures[-1]

    async def mouse(self, view, action, x):
        buttons = {"buttonLeft": int(action != "up"), "buttonMiddle": 0, "buttonRight": 0}
        keys = {"shiftKey": 0, "ctrlKey": 0, "altKey": 0, "metaKey": 0}
        await self.call("viewport.mouse.interaction", {"view": view, "action": action, "x": x, "y": 0.5, **buttons, **keys})


def test_a_remote_view():
    p, volume = box()
    look(p)
    p.show(auto_close=False)

    # Lightness, which JPEG keeps: green is most of it.
    def apart(picture):
        return np.abs(picture - truth(p, None))[..., 1].mean()

    async def session():
        with SinglePageLayout(get_server("of the tests", client_type="vue3")) as layout, layout.content:
            shown = plotter_ui(p, mode="server", default_server_rendering=True)
        server = shown.server
        running = server.start(exec_mode="task", port=0, open_browser=False, show_connection_info=False)
        await server.ready
        address = f"http://localhost:{server.port}/ws"
        async with aiohttp.ClientSession() as client, client.ws_connect(address, max_msg_size=0) as socket:
            browser = Browser(socket)
            await browser.call("wslink.hello", {"secret": "wslink-secret"})
            view = (await browser.call("viewport.image.push.observer.add", shown._helper.id(p.render_window)))["viewId"]
            await browser.call("viewport.image.push.quality", view, 100, 1)
            await browser.call("viewport.image.push", {"view": view})
            still = await browser.last_picture()
            assert still.shape == (SIZE[1], SIZE[0], 3) and apart(still) < 0.5
            await browser.mouse(view, "down", 0.5)
            sizes = set()
            for x in (0.52, 0.55, 0.6):
                await browser.mouse(view, "move", x)
                sizes.add(volume._drawn[2].shape[:2])
            assert (SIZE[1] // 2, SIZE[0] // 2) in sizes
            await browser.mouse(view, "up", 0.6)
            await browser.call("viewport.image.push", {"view": view})
            assert apart(await browser.last_picture()) < 0.5 and np.abs(still - truth(p, None)).mean() > 3
        await server.stop()
        running.cancel()

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        asyncio.run(asyncio.wait_for(session(), 100))
    assert volume.error is None
    p.close()
