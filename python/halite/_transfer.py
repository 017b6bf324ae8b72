# SPDX-License-Identifier: MIT OR Apache-2.0
"""Colours and opacities of scalars."""
from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _halite

Color = Union[str, npt.ArrayLike, Callable[[float], Sequence[float]]]
Shade = Union[bool, Sequence[float], Mapping[str, Any]]
Table = tuple[npt.ArrayLike, Sequence[float], Sequence[float]]


class TransferFunction:
    """Colour and opacity of a scalar, or of two; it never changes.

    Parameters
    ----------
    color : str, array of shape (n, 4), or colour map of matplotlib
        A colour map by name ("viridis", "cool to warm", "turbo_r", ...), one as an object, which is called with shares in [0, 1],
        or knots (scalar, red, green, blue) that ascend, colours in [0, 1]. Colours are linear between knots; two knots at one
        scalar are a step.
    clim : two floats
        The range of scalars that a colour map, and opacities without scalars, lie over.
    opacity : float, array of shape (n,), or array of shape (n, 2)
        One opacity for all; opacities that lie evenly over `clim`; or knots (scalar, opacity) that ascend. They are 0 or more.
    unit_distance : float
        The length that opacities are meant for, in world units, above 0.
    convention : {"extinction", "opacity"}
        Whether extinction is a / d, as in VTK's mappers of unstructured grids, or -ln(1 - a) / d, as in those of images, where
        opacities are 1 at most.
    emission_scale : float, optional
        Makes emission independent of opacity: colour times this for each unit of length. By default it is colour times
        extinction.
    clamp : bool
        Whether the ends hold outside the knots; else nothing is seen there.
    gradient_opacity : array of shape (n, 2)
        Knots (g, factor) of what extinction is multiplied by, over the length of the gradient, in units of the scalar per world
        unit, or over the renderer's `gradient_array`.
    widgets : list of dict
        Shapes in the plane of scalar and gradient, in the place of colour and opacity. Keys are those of scene files: "type" is
        "uniform", "gaussian" (with "center" and "sigma"), "triangle" or "sinusoid" (with "v0" and "period"); "color";
        "opacity"; ranges "s" and "g", with None for an open end.
    table2d : (texels, s_range, g_range), optional
        Likewise, as a table: texels of shape (rows over g, columns over s, 4) are red, green, blue and opacity, not multiplied;
        the ranges are those of the outer texels' edges.
    silhouette : float, optional
        p, 0 or more: extinction is multiplied by (1 - abs(n.d))^p, n the gradient's direction and d the ray's.
    shade : bool, (ambient, diffuse, specular, power), or dict, optional
        Whether colours are lit, with the gradient's direction as normal. True is (0.1, 0.7, 0.2, 10); a dict may also say
        "two_sided" and "highlight" ("half" or "reflected").
    lights : list of dict, optional
        With `shade`: a light has "type" ("headlight", "direction" or "position"), "direction" or "position", and may have
        "color", "intensity", "attenuation" and "cone". One headlight by default.

    Raises
    ------
    Error
        If a name is not known, knots do not ascend, or a number is out of its range.

    Examples
    --------
    >>> fog = halite.TransferFunction([(0, 0.2, 0.3, 0.8), (1, 0.9, 0.3, 0.1)], opacity=[(0, 0), (1, 0.5)], unit_distance=0.1)
    >>> fog.opacity
    array([[0. , 0. ],
           [1. , 0.5]])
    >>> blob = {"type": "gaussian", "center": [0.5, 2], "sigma": [0.1, 1], "color": [1, 0.8, 0.2], "opacity": 0.7}
    >>> lit = halite.TransferFunction(widgets=[blob], shade=True)
    """

    def __init__(self, color: Color = "viridis", clim: Sequence[float] = (0.0, 1.0), *, opacity: npt.ArrayLike = 1.0,
                 unit_distance: float = 1.0, convention: str = "extinction", emission_scale: Optional[float] = None,
                 clamp: bool = True, gradient_opacity: npt.ArrayLike = (), widgets: Sequence[Mapping[str, Any]] = (),
                 table2d: Optional[Table] = None, silhouette: Optional[float] = None, shade: Optional[Shade] = None,
                 lights: Optional[Sequence[Mapping[str, Any]]] = None) -> None:
        low, high = (float(x) for x in clim)
        if not low <= high:
            raise _halite.Error(f"clim is a range that ascends, and not {low} to {high}")
        if isinstance(opacity, str):
            raise _halite.Error(f'opacity is a number or an array, and not "{opacity}"; halite.pyvista knows PyVista\'s names')
        second: dict[str, Any] = {}
        factors = np.asarray(gradient_opacity, float).reshape(-1, 2).tolist()
        for key, value in (("gradient_opacity", factors), ("widgets", list(widgets)), ("silhouette", silhouette),
                           ("shade", _shade(shade)), ("lights", lights)):
            if value is not None and value != []:
                second[key] = value
        if table2d is not None and second.get("widgets"):
            raise _halite.Error("table2d: there are widgets, and only one of the two can say colour and opacity")
        self._core = _halite.TransferFunction(_colors(color, low, high), _opacities(opacity, low, high), float(unit_distance),
                                              convention, emission_scale, bool(clamp), json.dumps(second, default=_plain),
                                              _table(table2d))

    @classmethod
    def _of(cls, core: _halite.TransferFunction) -> TransferFunction:
        function = cls.__new__(cls)
        function._core = core
        return function

    @property
    def color(self) -> npt.NDArray[np.float64]:
        """The knots (scalar, red, green, blue), of shape (n, 4); none if widgets or a table say the colour."""
        return np.array(self._core.color).reshape(-1, 4)

    @property
    def opacity(self) -> npt.NDArray[np.float64]:
        """The knots (scalar, opacity), of shape (n, 2); none if widgets or a table say the opacity."""
        return np.array(self._core.opacity).reshape(-1, 2)

    @property
    def unit_distance(self) -> float:
        """The length that opacities are meant for, in world units."""
        return self._core.unit_distance

    def __reduce__(self) -> NoReturn:
        raise TypeError("a halite.TransferFunction cannot be pickled: pickle what it is made of")


def _plain(value: Any) -> Any:
    """Numpy's numbers and arrays as JSON has them."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no part of a transfer function")


def _shade(shade: Optional[Shade]) -> Optional[dict[str, Any]]:
    if shade is None or shade is False:
        return None
    if isinstance(shade, Mapping):
        return dict(shade)
    terms = (0.1, 0.7, 0.2, 10.0) if isinstance(shade, bool) else [float(x) for x in shade]
    if len(terms) != 4:
        raise _halite.Error(f"shade is (ambient, diffuse, specular, power), and not {len(terms)} numbers")
    return dict(zip(("ambient", "diffuse", "specular", "power"), terms))


def _table(table: Optional[Table]) -> Optional[tuple[npt.NDArray[np.float64], list[list[float]]]]:
    if table is None:
        return None
    texels, s, g = table
    array = np.ascontiguousarray(texels, np.float64)
    if array.ndim != 3:
        raise _halite.Error(f"a table has the shape (rows, columns, 4), and not {array.shape}")
    return array, [[float(x) for x in s], [float(x) for x in g]]


def _colors(color: Color, low: float, high: float) -> list[list[float]]:
    if isinstance(color, str):
        try:
            return _halite.colormap(color, low, high)
        except _halite.Error as error:
            raise _halite.Error(f"{error}; others of matplotlib may be given as objects") from None
    if callable(color):
        return [[low + (high - low) * u, *map(float, color(float(u))[:3])] for u in np.linspace(0, 1, 256)]
    knots: list[list[float]] = np.asarray(color, float).reshape(-1, 4).tolist()
    return knots


def _opacities(opacity: npt.ArrayLike, low: float, high: float) -> list[list[float]]:
    a = np.asarray(opacity, float)
    if a.ndim == 0:
        return [[low, float(a)]]
    if a.ndim == 1:
        return [[float(s), float(x)] for s, x in zip(np.linspace(low, high, len(a)), a)]
    knots: list[list[float]] = a.reshape(-1, 2).tolist()
    return knots
