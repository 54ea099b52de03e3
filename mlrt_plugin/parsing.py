"""Mitsuba's parser, driven so that nothing of the caller's session changes.

A scene is read in the variant ``scalar_rgb``, which needs no LLVM, through variant-free
entry points: the variant that the caller has set, if any, stays set.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import mitsuba as mi

from .elements import Element, from_state
from .errors import SceneError, one_sentence
from .mesh_files import bad_vertices
from .threads import threads_for_files

READING_VARIANT = "scalar_rgb"

mitsuba: Any = mi
"""For what Mitsuba's type stubs leave out."""

REMEDIES = (
    ("unused parameter", "remove the -D that the scene does not use, or mend its name"),
    ("undefined parameter", "give it a value by -D or by a <default> in the scene"),
    ("unreferenced propert", "remove the property or mend its name"),
    ("unresolved reference", "mend the reference"),
    (
        "file not found|No such file",
        "check the path of the file, which is relative to the scene",
    ),
    ("Could not map", "check that the file is not empty and can be read"),
    (
        "Storing new normals",
        "the mesh file has no faces and may be truncated, export it anew",
    ),
    ("invalid vertex position", "the mesh has NaN or infinite vertices, repair it"),
    ("invalid vertex", "repair the mesh or export it anew"),
    ("triangle mesh", "triangulate the mesh"),
    ("Plugin .* not found", "check the spelling of the plugin's type"),
    ("crop window", "make the crop window lie within the film, or remove it"),
    ("is out of bounds", "choose a value within these bounds"),
    ("missing version", 'add version="3.0.0" to the <scene>'),
    ("Parsing of XML", "mend the XML there"),
    (r"read \d+ out of", "the file is truncated, export it anew"),
    ("libpng|JPEG|OpenEXR", "the image is damaged, export it anew"),
    (
        "past the end of the stream|inflate|bytes required",
        "the mesh file is damaged, export it anew",
    ),
    ("I/O error|invalid PLY|invalid file format|value for field", "export the file anew"),
)
"""What to do about an error of Mitsuba, by what its message says; the first that fits
counts."""

T = TypeVar("T")


@dataclass
class ParsedScene:
    """A parsed scene, not yet loaded; ``elements[i]`` describes ``state.nodes[i]``.

    resolver: where its files are looked for, those of its <path> elements included.
    was_loaded: loading changes the state, which can be done once.
    """

    config: Any
    state: Any
    elements: list[Element]
    resolver: Any
    name: str
    was_loaded: bool = False

    @property
    def root(self) -> Element:
        return self.elements[0]

    def set_variant(self, variant: str) -> None:
        """Lets it be loaded in another variant; not if it holds loaded objects."""
        self.config = parser_config(variant)


def failing_element(message: str, elements: Sequence[Element]) -> Element | None:
    """The element with a file that a message is about, told by its place or its file."""
    with_files = [e for e in elements if "filename" in e.properties]
    for element in with_files:
        line, _, column = element.where.rpartition(" line ")[2].partition(":")
        if element.where and f"(line {line}, col {column})" in message:
            return element
    for element in with_files:
        if f'"{Path(element.properties["filename"]).name}"' in message:
            return element
    return None


def reported(action: Callable[[], T], name: str, elements: Sequence[Element] = ()) -> T:
    """Runs a step of Mitsuba; its errors become a SceneError of one sentence."""
    try:
        return action()
    except (RuntimeError, ValueError, TypeError, KeyError) as error:
        message = one_sentence(str(error))
        if "KeyboardInterrupt" in message:
            # Ctrl-C found Mitsuba in one of the plugins that are written in Python.
            raise KeyboardInterrupt from None
        element = failing_element(message, elements)
        filename = str(element.properties["filename"]) if element is not None else ""
        if element is not None and element.plugin in ("ply", "obj"):
            bad, count = bad_vertices(resolved(filename), element.plugin)
            if bad:
                raise SceneError(
                    f"{element} has {bad} of {count} vertices with NaN or infinite "
                    f"coordinates in '{filename}': repair the mesh"
                ) from error
        remedy = next((r for p, r in REMEDIES if re.search(p, message)), "mend the scene")
        if name not in message:
            message = f"scene '{name}': {message}"
        if filename not in message:
            message += f" in '{filename}'"
        raise SceneError(f"{message}; {remedy}") from error


def resolver_from(*folders: Path) -> Any:
    """A resolver that looks for files in these folders first, as Mitsuba's own loader looks
    in that of the scene, and then where the process does."""
    resolver = mitsuba.FileResolver(mitsuba.file_resolver())
    for folder in reversed(folders):
        resolver.prepend(str(folder))
    return resolver


@contextmanager
def resolving_from(*folders: Path) -> Iterator[None]:
    """Lets Mitsuba look for files in these folders first."""
    with resolving_by(resolver_from(*folders)):
        yield


@contextmanager
def resolving_by(resolver: Any) -> Iterator[None]:
    """Lets Mitsuba look for files as a resolver says."""
    before = mitsuba.file_resolver()
    mitsuba.set_file_resolver(resolver)
    try:
        yield
    finally:
        mitsuba.set_file_resolver(before)


def resolved(filename: str) -> Path:
    """Where Mitsuba finds a file."""
    return Path(str(mitsuba.file_resolver().resolve(filename)))


def described(state: Any) -> list[Element]:
    """The elements of a parsed scene, read from a copy: Mitsuba reports properties that no
    plugin has asked for, and looking at them counts as asking."""
    return from_state(mi.parser.ParserState(state))


def parser_config(variant: str) -> Any:
    getattr(mi, variant)
    config = mi.parser.ParserConfig(variant)
    # Merging loses the names of shapes and the order in which they were declared.
    config.merge_meshes = False
    config.merge_equivalent = False
    return config


def parse_file(
    path: Path, defines: Mapping[str, object], variant: str = READING_VARIANT
) -> ParsedScene:
    """Parses a scene file with values for its $parameters, to be loaded in a variant.

    Raises SceneError if it does not exist or is malformed, if a parameter is not defined,
    or if one of `defines` is not used.
    """
    if path.is_dir():
        raise SceneError(f"scene '{path}' is a folder: name the XML file in it")
    if not path.exists():
        raise SceneError(f"scene file '{path}' does not exist: check its path")
    config = parser_config(variant)
    values = {key: str(value) for key, value in defines.items()}

    def parse() -> Any:
        state = mi.parser.parse_file(config, str(path), **values)
        mi.parser.transform_upgrade(config, state)
        mi.parser.transform_resolve(config, state)
        return state

    resolver = resolver_from(path.parent)
    with resolving_by(resolver):
        state = reported(parse, str(path))
    return ParsedScene(config, state, described(state), resolver, str(path))


def parse_dict(scene: Mapping[str, Any], variant: str = READING_VARIANT) -> ParsedScene:
    """Parses a dictionary as ``mi.load_dict`` takes it, to be loaded in the variant of the
    objects that it holds, else in `variant`.

    Raises SceneError if it is malformed, or holds objects of an unusable variant.
    """
    name = "dictionary"
    variants = {o.variant_name() for o in embedded_objects(scene)} - {""}
    if len(variants) > 1:
        raise SceneError(
            f"the scene {name} holds objects of several variants "
            f"({', '.join(sorted(variants))}): "
            "load all of them in one"
        )
    variant = variants.pop() if variants else variant
    if not variant.endswith("_rgb"):
        raise SceneError(
            f"the scene {name} holds objects of the variant {variant}: load them in an "
            "RGB variant"
        )
    config = parser_config(variant)

    def parse() -> Any:
        state = mi.parser.parse_dict(config, with_known_integrators(scene))
        mi.parser.transform_upgrade(config, state)
        mi.parser.transform_resolve(config, state)
        return state

    state = reported(parse, name)
    elements = described(state)
    for key, value in scene.items():
        if is_own_integrator(value):
            for child_name, element in elements[0].children:
                if child_name == key:
                    element.plugin = "mlrt"
    return ParsedScene(config, state, elements, resolver_from(Path()), name)


def is_own_integrator(value: object) -> bool:
    return isinstance(value, Mapping) and value.get("type") == "mlrt"


def with_known_integrators(scene: Mapping[str, Any]) -> dict[str, Any]:
    """The dictionary without integrators that only the caller's variant knows."""
    return {
        key: {**value, "type": "direct"} if is_own_integrator(value) else value
        for key, value in scene.items()
    }


def embedded_objects(value: object) -> Iterator[Any]:
    """All Mitsuba objects that a scene dictionary holds; images have no variant."""
    if isinstance(value, mi.Object):
        yield value
    elif isinstance(value, Mapping):
        for child in value.values():
            yield from embedded_objects(child)


COLLECTOR = "mlrt_scene_parts"
"""Plugin that stands in for a scene; registered where scenes are read."""

_collecting: set[str] = set()


def register_collector(variant: str) -> None:
    """Makes a plugin known that keeps what is declared in it, and does nothing else.

    A `scene` would build Mitsuba's own acceleration structure, which takes several times as
    long as loading the meshes.
    """
    if variant in _collecting:
        return
    module: Any = getattr(mi, variant)

    class Collector(module.Texture):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            values = (props[name] for name in props.keys())  # noqa: SIM118
            self.parts = [value for value in values if isinstance(value, mi.Object)]

    module.register_texture(COLLECTOR, Collector)
    _collecting.add(variant)


def instantiate(
    parsed: ParsedScene, left_out: Collection[str] = ()
) -> tuple[list[Any], dict[str, Element]]:
    """Loads what a parsed scene declares, in that order, and tells which element each
    object came from, by its id.

    left_out: names of children of the scene that are not loaded. Integrators are not loaded
    either: they are taken over, and may be unknown in the reading variant.
    """
    by_id = numbered(parsed)
    register_collector(parsed.config.variant)
    root = parsed.state.nodes[0]
    for name in left_out:
        del root.props[name]
    root.props.set_plugin_name(COLLECTOR)
    root.type = mi.ObjectType.Texture
    return loaded(parsed).parts, by_id


def numbered(parsed: ParsedScene) -> dict[str, Element]:
    """Gives all nodes ids by which to find their elements, and takes integrators out.

    Raises RuntimeError if that has been done before.
    """
    if parsed.was_loaded:
        raise RuntimeError(
            f"scene '{parsed.name}' was loaded from this before: parse it anew"
        )
    parsed.was_loaded = True
    by_id = {}
    for number, (node, element) in enumerate(
        zip(parsed.state.nodes, parsed.elements, strict=True)
    ):
        if element.kind == "integrator":
            node.props = mi.Properties("direct")
        name = f"n{number}"
        node.props.set_id(name)
        by_id[name] = element
    return by_id


def loaded(parsed: ParsedScene) -> Any:
    """The object that the root of a parsed scene describes; raises SceneError."""
    with resolving_by(parsed.resolver), threads_for_files():
        return reported(
            lambda: mi.parser.instantiate(parsed.config, parsed.state),
            parsed.name,
            parsed.elements,
        )
