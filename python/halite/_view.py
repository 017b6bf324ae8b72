# SPDX-License-Identifier: MIT OR Apache-2.0
"""From where meshes are seen."""
from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _halite
from ._transfer import _plain

Plane = tuple[Sequence[float], Sequence[float]]
Cropping = tuple[Sequence[float], Union[str, int]]


def _three(v: Sequence[float]) -> list[float]:
    return [float(x) for x in v]


class View:
    """From where a mesh is seen, as by VTK's camera; it never changes.

    Parameters
    ----------
    position : three floats
        Where the eye is, in world units.
    focal_point : three floats
        What it looks at.
    view_up : three floats
        What is up in the picture; not along the direction of view.
    view_angle : float
        The vertical angle of view, in degrees, between 0 and 180.
    parallel_scale : float, optional
        Makes the view parallel: half its height, in world units.
    clipping_range : two floats, optional
        Distances along the direction of view between which anything is seen, in world units.
    size : (width, height)
        Of the picture, in pixels.
    pixel_offset : two floats
        Where in a pixel its ray is, from the centre, in pixels to the right and up.
    planes : list of (origin, normal)
        Clipping planes: what all normals point into is kept.
    cropping : (planes, regions), optional
        Some of 27 regions alone: (x0, x1, y0, y1, z0, z1), and "subvolume", "fence", "inverted fence", "cross", "inverted cross", or
        bits, x + 3 y + 9 z that of region (x, y, z).
    opaque : list of dict
        Objects at which rays end: {"type": "plane", "point", "normal", "color"} or {"type": "sphere", "center", "radius", "color"}.
        :meth:`backdrop` is what is seen of them.

    Raises
    ------
    Error
        If these make no view: an angle or a range out of bounds, a direction of length 0, a size of 0.

    Examples
    --------
    >>> view = halite.View((3, -5, 2), (0, 0, 0), (0, 0, 1), view_angle=35, size=(320, 240))
    >>> view.size
    (320, 240)
    >>> ball = {"type": "sphere", "center": [0, 0, 0], "radius": 0.2, "color": [1, 0, 0]}
    >>> half = halite.View((3, -5, 2), parallel_scale=1.5, planes=[((0, 0, 0), (1, 0, 0))], opaque=[ball])
    """

    def __init__(self, position: Sequence[float], focal_point: Sequence[float] = (0, 0, 0), view_up: Sequence[float] = (0, 1, 0), *,
                 view_angle: float = 30.0, parallel_scale: Optional[float] = None, clipping_range: Optional[Sequence[float]] = None,
                 size: Sequence[int] = (1024, 768), pixel_offset: Sequence[float] = (0.0, 0.0), planes: Sequence[Plane] = (),
                 cropping: Optional[Cropping] = None, opaque: Sequence[Mapping[str, Any]] = ()) -> None:
        scale = None if parallel_scale is None else float(parallel_scale)
        depths = None if clipping_range is None else [float(x) for x in clipping_range]
        core = _halite.View.from_camera(_three(position), _three(focal_point), _three(view_up), float(view_angle), scale, depths,
                                        [int(n) for n in size])
        self._core = _limited(core, pixel_offset, planes, cropping, opaque)

    @classmethod
    def from_matrices(cls, world_to_eye: npt.ArrayLike, eye_to_clip: npt.ArrayLike, size: Sequence[int], *,
                      pixel_offset: Sequence[float] = (0.0, 0.0), planes: Sequence[Plane] = (),
                      cropping: Optional[Cropping] = None, opaque: Sequence[Mapping[str, Any]] = ()) -> View:
        """Make a view of OpenGL's matrices.

        Parameters
        ----------
        world_to_eye : array of shape (4, 4)
            For column vectors; rigid, or with a scale.
        eye_to_clip : array of shape (4, 4)
            A perspective or parallel projection to clip coordinates in [-1, 1], oblique or not.
        size : (width, height)
            Of the picture, in pixels.
        pixel_offset, planes, cropping, opaque
            As of the class.

        Returns
        -------
        View
            The view, with the clipping range of the projection.

        Raises
        ------
        Error
            If a matrix is singular, or no such projection.

        Examples
        --------
        >>> to_eye = np.eye(4)
        >>> to_eye[2, 3] = -5
        >>> halite.View.from_matrices(to_eye, np.diag([0.5, 0.5, -0.1, 1]), (64, 64)).size
        (64, 64)
        """
        eye, clip = ([[float(x) for x in row] for row in np.asarray(m)] for m in (world_to_eye, eye_to_clip))
        core = _halite.View.from_matrices(eye, clip, [int(n) for n in size])
        return cls._of(_limited(core, pixel_offset, planes, cropping, opaque))

    @classmethod
    def from_vtk(cls, camera: Any, size: Sequence[int] = (1024, 768), **options: Any) -> View:
        """Make a view of a camera of VTK or PyVista, without what it has of shears and off-axis projections.

        Parameters
        ----------
        camera : vtkCamera
            Or PyVista's class of it.
        size : (width, height)
            Of the picture, in pixels.
        **options
            As of the class: `pixel_offset`, `planes`, `cropping`, `opaque`.

        Returns
        -------
        View
            The view, with the camera's clipping range.

        Raises
        ------
        Error
            If the camera makes no view.

        Examples
        --------
        >>> from vtkmodules.vtkRenderingCore import vtkCamera
        >>> camera = vtkCamera()
        >>> camera.SetPosition(0, 0, 5)
        >>> halite.View.from_vtk(camera, (320, 240)).size
        (320, 240)
        """
        scale = camera.GetParallelScale() if camera.GetParallelProjection() else None
        return cls(camera.GetPosition(), camera.GetFocalPoint(), camera.GetViewUp(), view_angle=camera.GetViewAngle(),
                   parallel_scale=scale, clipping_range=camera.GetClippingRange(), size=size, **options)

    @classmethod
    def _of(cls, core: _halite.View) -> View:
        view = cls.__new__(cls)
        view._core = core
        return view

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, in pixels."""
        width, height = self._core.size
        return (width, height)

    def backdrop(self, background: Sequence[float] = (0.0, 0.0, 0.0)) -> npt.NDArray[np.float32]:
        """Draw what is seen of the opaque objects, without light, for :func:`write` to put behind a picture.

        Parameters
        ----------
        background : three floats
            The colour where there is none, in [0, 1].

        Returns
        -------
        float32 array of shape (height, width, 3)
            Red, green and blue, in [0, 1]; row 0 is uppermost.

        Raises
        ------
        MemoryError
            If there is no memory for the picture.

        Examples
        --------
        >>> wall = {"type": "plane", "point": [0, 0, -3], "normal": [0, 0, 1], "color": [1, 0.5, 0]}
        >>> halite.View((0, 0, 5), size=(4, 3), opaque=[wall]).backdrop()[0, 0]
        array([1. , 0.5, 0. ], dtype=float32)
        """
        red, green, blue = (float(x) for x in background)
        return self._core.backdrop([red, green, blue])

    def __reduce__(self) -> NoReturn:
        raise TypeError("a halite.View cannot be pickled: pickle what it is made of")


def _limited(core: _halite.View, pixel_offset: Sequence[float], planes: Sequence[Plane], cropping: Optional[Cropping],
             opaque: Sequence[Mapping[str, Any]]) -> _halite.View:
    if any(pixel_offset):
        core = core.offset([float(x) for x in pixel_offset])
    if len(planes):
        core = core.clipped([[_three(v) for v in plane] for plane in planes])
    if cropping is not None:
        edges, regions = cropping
        core = core.cropped(np.reshape(np.asarray(edges, float), (3, 2)).tolist(), regions)
    return core.before([json.dumps(o, default=_plain) for o in opaque]) if len(opaque) else core
