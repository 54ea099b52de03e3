"""Who is measured: the ways to build that both engines have."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

from .errors import BenchError
from .measure import Run

MLRT, EMBREE = "MLRT", "Embree"
LAZY = "lazy"
BUILDERS, QUALITIES = ("exact", "fast", LAZY), ("MEDIUM", "HIGH")
ISAS = ("avx2", "avx512")
"""Instruction sets that both engines have, by their name in both."""
WARM_UP_FACES = 2000
"""Of a scene, that each contender builds and renders before it is measured."""
ENOUGH_SECONDS = 90.0
"""A contender whose runs took longer than that in all is not run again, once it has run
twice; chosen, for the exact builder on millions of triangles."""


@dataclass
class Contender:
    """A way to build, and what came of it."""

    engine: str
    kind: str
    build: Callable[[Any], Any]
    """Of a mesh; returns what the native side built."""
    render: Callable[..., Any]
    """Of what was built, the view, the image, and an array of primitives or nothing."""
    runs: list[Run] = field(default_factory=list)
    facts: dict[str, Any] = field(default_factory=dict)
    """Of the last run: bytes and the builder's report."""

    @property
    def name(self) -> str:
        return f"{self.engine} {self.kind}"

    def needs_run(self, repeats: int) -> bool:
        """Whether there are fewer than ``repeats`` runs that nobody disturbed."""
        spent = sum(run.build.wall + run.frame.wall for run in self.runs)
        if len(self.runs) >= 2 and spent > ENOUGH_SECONDS:
            return False
        return sum(not run.busy for run in self.runs) < repeats


def embree_device(module: ModuleType, threads: int, isa: str | None = None) -> Any:
    """A device whose threads are started beforehand, as those of MLRT's pool are.

    isa: the widest instruction set that it may use, one of ISAS; all for None. Raises
    BenchError for another one, of which Embree would not tell. There should be one device
    at a time: see the native side.
    """
    if isa is not None and isa not in ISAS:
        raise BenchError(
            f"Embree cannot be limited to '{isa}': choose {' or '.join(ISAS)} by MLRT_ISA"
        )
    limit = "" if isa is None else f",isa={isa}"
    return module.EmbreeDevice(f"threads={threads},set_affinity=0,start_threads=1{limit}")


def contenders_of(module: ModuleType, device: Any) -> list[Contender]:
    def mlrt(builder: str) -> Contender:
        return Contender(
            MLRT,
            builder,
            lambda mesh: module.KdTree(mesh, {"builder": builder}),
            lambda tree, view, image, primitives: tree.render(view, {}, image, primitives),
        )

    def embree(kind: str) -> Contender:
        return Contender(
            EMBREE,
            kind,
            lambda mesh: module.EmbreeScene(device, mesh, kind == "HIGH"),
            lambda scene, view, image, primitives: scene.render(view, image, primitives),
        )

    return [*map(mlrt, BUILDERS), *map(embree, QUALITIES)]
