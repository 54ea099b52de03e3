"""The elements of a scene as a tree of names and properties, loaded or not."""

from __future__ import annotations

import bisect
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from . import mitsuba_objects as objects


@dataclass
class Element:
    """One plugin of the scene: ``kind`` is Mitsuba's type of object in lower case.

    loaded: whether it was an object already, which shows none of its properties.
    """

    kind: str
    plugin: str
    id: str = ""
    where: str = ""
    properties: dict[str, Any] = field(default_factory=dict)
    children: list[tuple[str, Element]] = field(default_factory=list)
    loaded: bool = False

    def children_of(self, kind: str) -> Iterator[Element]:
        return (child for _, child in self.children if child.kind == kind)

    def walk(self) -> Iterator[Element]:
        """This element and all that it holds, each once for each place where it is used."""
        yield self
        for _, child in self.children:
            yield from child.walk()

    def __str__(self) -> str:
        name = f"{self.kind} '{self.plugin}'"
        if self.id:
            name += f" with id '{self.id}'"
        return f"{name} at {self.where}" if self.where else name


def walk_once(roots: Iterable[Element]) -> Iterator[Element]:
    """Some elements and all that they hold, each once, before what it holds."""
    seen: set[int] = set()
    for root in roots:
        waiting = [root]
        while waiting:
            element = waiting.pop()
            if id(element) in seen:
                continue
            seen.add(id(element))
            yield element
            for _, child in reversed(element.children):
                if id(child) not in seen:
                    waiting.append(child)


KINDS = {
    "Scene": "scene",
    "Sensor": "sensor",
    "Film": "film",
    "ReconstructionFilter": "rfilter",
    "Sampler": "sampler",
    "Integrator": "integrator",
    "Emitter": "emitter",
    "Shape": "shape",
    "BSDF": "bsdf",
    "Texture": "texture",
    "Volume": "volume",
    "Medium": "medium",
    "PhaseFunction": "phase function",
}


def kind_of(instance: Any) -> str:
    """The kind of a loaded object."""
    module = objects.variant_module(instance)
    for name, kind in KINDS.items():
        base = getattr(module, name, None)
        if base is not None and isinstance(instance, base):
            return kind
    return "object"


class Places:
    """Where in the files of a scene its elements are, as Mitsuba counts lines and columns.

    Mitsuba itself reads the file anew for each element, which takes hours for scenes with
    many.
    """

    def __init__(self, files: list[str]) -> None:
        self._files = files
        self._line_ends: dict[int, list[int]] = {}

    def of(self, file: int, offset: int) -> str:
        """File, line and column of a node of the parser; empty if it is in no file."""
        if file >= len(self._files):
            return ""
        if file not in self._line_ends:
            content = np.frombuffer(Path(self._files[file]).read_bytes(), np.uint8)
            self._line_ends[file] = np.flatnonzero(content == ord("\n")).tolist()
        ends = self._line_ends[file]
        line = bisect.bisect_left(ends, offset)
        start = ends[line - 1] + 1 if line else 0
        return f"{self._files[file]} line {line + 1}:{offset - start + 1}"


def from_state(state: Any) -> list[Element]:
    """The element of each node of a parsed scene; the first is the scene itself. Objects
    that are the same in all variants, images, count as properties."""
    elements = []
    places = Places([str(file) for file in state.files])
    # Scenes have a hundred thousand nodes: names of enumerations are looked up once.
    kinds = {t: KINDS.get(t.name, t.name.lower()) for t in mi.ObjectType}
    reference: Any = mi.Properties.ResolvedReference
    all_properties = []
    for node in state.nodes:
        props = node.props
        all_properties.append(props)
        elements.append(
            Element(
                kind=kinds[node.type],
                plugin=props.plugin_name(),
                id=props.id(),
                where=places.of(node.file_index, node.offset),
            )
        )
    for props, element in zip(all_properties, elements, strict=True):
        for name in props.keys():  # noqa: SIM118 (Properties is no mapping)
            value = props[name]
            if isinstance(value, reference):
                element.children.append((name, elements[value.index()]))
            elif isinstance(value, mi.Object) and value.variant_name():
                element.children.append((name, from_object(value, name)))
            else:
                element.properties[name] = value
    return elements


def from_object(instance: Any, fallback_id: str = "") -> Element:
    """The element of a loaded object with what it shows of its insides."""
    kind = kind_of(instance)
    plugin = objects.plugin_name(instance)
    element = Element(kind, plugin, instance.id() or fallback_id, loaded=True)
    if kind == "shape":
        nested = {"bsdf": instance.bsdf(), "emitter": instance.emitter()}
        nested["interior"] = instance.interior_medium()
        nested["exterior"] = instance.exterior_medium()
        if element.plugin == "instance":
            element.properties["loaded"] = True
        if element.plugin in ("sphere", "cylinder"):
            element.properties["to_world"] = objects.members(instance)["to_world"]
        if element.plugin == "rectangle":
            element.properties["flip_normals"] = bool(instance.has_flipped_normals())
    elif kind == "sensor":
        nested = {"film": instance.film(), "sampler": instance.sampler()}
    elif kind == "film":
        nested = {"rfilter": instance.rfilter()}
    elif kind in ("bsdf", "emitter") or plugin == "checkerboard":
        nested = {k: v for k, v in objects.members(instance).items()}
    else:
        nested = {}
    for name, child in nested.items():
        if isinstance(child, mi.Object):
            element.children.append((name, from_object(child, name)))
    return element


def from_scene(scene: Any, sensors: list[Any]) -> Element:
    """The element of a loaded scene, seen by the given sensors."""
    root = Element("scene", "scene", scene.id())
    emitters_of_shapes = [shape.emitter() for shape in scene.shapes()]
    for instance in [
        *sensors,
        *scene.shapes(),
        *(e for e in scene.emitters() if not any(e is s for s in emitters_of_shapes)),
        *([scene.integrator()] if scene.integrator() is not None else []),
    ]:
        root.children.append((instance.id(), from_object(instance)))
    return root
