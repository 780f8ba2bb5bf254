"""Scene files: TOML into a :class:`~brdfit.scenes.Scene`, with every fault named by file, line and key."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..errors import InputError
from ..files import StrPath, reading
from .images import read_image
from .scene import (
    MEASURES,
    Ambient,
    Area,
    Camera,
    Directional,
    Environment,
    Frustum,
    Light,
    Plane,
    Point,
    Scene,
    Shape,
    Sphere,
    Tolerance,
    Vector,
)
from .toml_lines import Lines

KeyPath = tuple[str | int, ...]
T = TypeVar("T")

LARGEST = 4096
"""Pixels along one side of a picture, at most."""


def load_scene(path: StrPath) -> Scene:
    """The scene in a TOML file (docs/scenes.md lists the keys).

    Raises InputError, in one line with file, line and key, for anything that is not a scene.
    """
    with reading(path) as file:
        raw = file.read()
    try:
        text = raw.decode("utf-8")
        document = tomllib.loads(text)
    except UnicodeDecodeError as fault:
        raise InputError(f"{path}: is not text (byte {fault.start}); name a scene file in TOML") from None
    except tomllib.TOMLDecodeError as fault:
        raise InputError(f"{path}: is not TOML: {fault}") from None
    return _scene(Section(path, Lines(text), (), document))


class Section:
    """One table of a file: hands out checked values, and complains about keys that nobody asked for."""

    def __init__(self, file: StrPath, lines: Lines, path: KeyPath, values: Mapping[str, Any]) -> None:
        self.file, self.lines, self.path, self.values = file, lines, path, values
        self.asked: set[str] = set()

    def fault(self, key: str, what: str) -> InputError:
        """The error to raise about a key, or about the table itself (``key`` empty)."""
        names = [p if isinstance(p, str) else f"{p + 1}" for p in (*self.path, *([key] if key else []))]
        line = self.lines((*self.path, key) if key else self.path)
        return InputError(f"{self.file}, line {line}: {' '.join(names) or 'the file'} {what}")

    def get(self, key: str, convert: Callable[[Any], T], wanted: str, default: T | None = None) -> T:
        """The value of a key, converted; ``convert`` raises ValueError or TypeError for what is not ``wanted``."""
        self.asked.add(key)
        if key not in self.values:
            if default is None:
                raise self.fault("", f"misses the key {key!r}: {wanted}")
            return default
        try:
            return convert(self.values[key])
        except (ValueError, TypeError):
            raise self.fault(key, f"must be {wanted}, not {self.values[key]!r}") from None

    def number(self, key: str, default: float | None = None, above: float = -math.inf, below: float = math.inf) -> float:
        """A finite number in an open interval."""

        def convert(value: Any) -> float:
            if isinstance(value, bool) or not isinstance(value, int | float) or not above < value < below:
                raise ValueError
            return float(value)

        bounds = {(False, False): "a number", (True, False): f"a number above {above:g}"}
        limits = math.isfinite(above), math.isfinite(below)
        return self.get(key, convert, bounds.get(limits, f"a number between {above:g} and {below:g}"), default)

    def vector(self, key: str, default: Vector | None = None, direction: bool = False) -> Vector:
        """Three numbers, not all 0 for a direction."""

        def convert(value: Any) -> Vector:
            x, y, z = _numbers(value, 3)
            if direction and not x * x + y * y + z * z > 0:
                raise ValueError
            return x, y, z

        return self.get(key, convert, f"three numbers, [x, y, z]{', not all 0' if direction else ''}", default)

    def colour(self, key: str) -> Vector:
        """One number or three, none negative."""

        def convert(value: Any) -> Vector:
            r, g, b = _numbers([value] * 3 if isinstance(value, int | float) else value, 3)
            if min(r, g, b) < 0:
                raise ValueError
            return r, g, b

        return self.get(key, convert, "a number or [red, green, blue], none negative")

    def choice(self, key: str, choices: Mapping[str, T], default: str | None = None) -> T:
        """One of some words."""
        return self.get(key, lambda v: choices[_word(v, choices)], f"one of {', '.join(choices)}",
                        None if default is None else choices[default])  # fmt: skip

    def table(self, key: str) -> Section:
        """A table within this one; raises if it is missing."""
        self.asked.add(key)
        value = self.values.get(key)
        if value is None:
            raise self.fault("", f"misses the table [{key}]")
        if not isinstance(value, dict):
            raise self.fault(key, f"must be a table, [{key}]")
        return Section(self.file, self.lines, (*self.path, key), value)

    def end(self) -> None:
        """Raise about the first key that nobody asked for."""
        for key in self.values:
            if key not in self.asked:
                raise self.fault(key, f"is not known here; known: {', '.join(sorted(self.asked))}")


def _word(value: Any, choices: Mapping[str, Any]) -> str:
    if not isinstance(value, str) or value not in choices:
        raise ValueError
    return value


def _numbers(value: Any, count: int) -> list[float]:
    if not isinstance(value, list) or len(value) != count:
        raise ValueError
    if any(isinstance(x, bool) or not isinstance(x, int | float) or not math.isfinite(x) for x in value):
        raise ValueError
    return [float(x) for x in value]


def _scene(t: Section) -> Scene:
    name = t.get("name", _text, "a text", Path(t.file).stem)
    shape, camera = _shape(t.table("shape")), _camera(t.table("camera"))
    entries = t.get("light", lambda v: v if isinstance(v, list) and v else _refuse(), "at least one [[light]]")
    lights = tuple(_light(Section(t.file, t.lines, ("light", k), e), t) for k, e in enumerate(entries))
    images = [k for k, light in enumerate(lights) if isinstance(light, Environment)]
    if len(images) > 1:
        raise Section(t.file, t.lines, ("light", images[1]), {}).fault("image", "is a second environment; a scene has one")
    tolerance = _tolerance(t.table("tolerance")) if "tolerance" in t.values else Tolerance()
    scene = Scene(
        name,
        shape,
        camera,
        lights,
        exposure=t.number("exposure", above=0) if t.values.get("exposure", "auto") != "auto" else None,
        tolerance=tolerance,
        budget=t.number("budget", above=0) if "budget" in t.values else None,
        samples=t.get("samples", lambda v: _whole(v, 1, 1 << 16), "a whole number from 1 to 65536", 64),
    )
    t.asked |= {"exposure", "tolerance", "budget"}
    t.end()
    return scene


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise ValueError
    return value


def _refuse() -> Any:
    raise ValueError


def _whole(value: Any, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise ValueError
    return value


def _shape(t: Section) -> Shape:
    kind = t.choice("kind", {k: k for k in ("sphere", "plane", "cylinder", "cone")})
    centre = t.vector("centre", (0.0, 0.0, 0.0))
    shape: Shape
    if kind == "sphere":
        shape = Sphere(centre, t.number("radius", 1.0, above=0))
    elif kind == "plane":

        def size(value: Any) -> tuple[float, float]:
            a, b = _numbers(value, 2)
            return (a, b) if min(a, b) > 0 else _refuse()

        normal = t.vector("normal", (0.0, 0.0, 1.0), direction=True)
        shape = Plane(centre, normal, t.get("size", size, "two positive numbers", (2.0, 2.0)))
    else:
        radius, height = t.number("radius", 1.0, above=0), t.number("height", 2.0, above=0)
        axis = t.vector("axis", (0.0, 1.0, 0.0), direction=True)
        shape = Frustum(centre, axis, height, radius, radius if kind == "cylinder" else 0.0)
    t.end()
    return shape


def _camera(t: Section) -> Camera:
    kind = t.choice("kind", {k: k for k in ("orthographic", "perspective")})
    eye, target = t.vector("from"), t.vector("to", (0.0, 0.0, 0.0))
    up = t.vector("up", (0.0, 1.0, 0.0), direction=True)
    if np.linalg.norm(np.cross(np.subtract(target, eye), up)) < 1e-9:
        key = "from" if eye == target else "up"
        raise t.fault(key, "must not be where the camera looks at" if key == "from" else "must not lie along the view")

    def pixels(value: Any) -> tuple[int, int]:
        w, h = value
        return _whole(w, 1, LARGEST), _whole(h, 1, LARGEST)

    size = t.get("pixels", pixels, f"two whole numbers from 1 to {LARGEST}, [width, height]", (256, 256))
    width = t.number("width", 2.2, above=0) if kind == "orthographic" else None
    field = t.number("field", 30.0, above=0, below=180) if kind == "perspective" else None
    t.end()
    return Camera(eye, target, up, size, width, field)


def _light(t: Section, scene: Section) -> Light:
    kind = t.choice("kind", {k: k for k in ("directional", "point", "area", "environment", "ambient")})
    light: Light
    if kind == "directional":
        light = Directional(t.vector("direction", direction=True), t.colour("irradiance"))
    elif kind == "point":
        light = Point(t.vector("position"), t.colour("intensity"))
    elif kind == "area":
        light = Area(t.vector("centre"), t.number("radius", above=0), t.colour("radiance"))
    elif kind == "ambient" or "radiance" in t.values:  # an even environment is ambient light
        light = Ambient(t.colour("radiance"))
    else:
        source = t.get("image", _text, "the path of an .exr or .hdr image")
        scale = t.number("scale", 1.0, above=0)
        try:
            image = read_image(Path(t.file).parent / source)
        except InputError as fault:
            raise t.fault("image", f"cannot be used: {fault}") from None
        light = Environment(scale * image, source)
    t.end()
    return light


def _tolerance(t: Section) -> Tolerance:
    measure = t.choice("measure", {k: k for k in MEASURES}, "itp")
    limit = t.number("limit", MEASURES[measure][0], above=0)
    t.end()
    return Tolerance(measure, limit)


__all__ = ["load_scene"]
