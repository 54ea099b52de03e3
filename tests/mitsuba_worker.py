"""Renders reference pictures with Mitsuba's llvm_ad_rgb, in a process of its own.

Dr.Jit looks for libLLVM once, when it is imported, and tests have imported it long before.
Run as a script it reads jobs from standard input, one a line (JSON: the name of a function
below and its arguments), and answers each with the path of a .npy file.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

READY = "ready"


class Unavailable(Exception):
    """There is no libLLVM that Mitsuba could use; the message says why."""


class MitsubaWorker:
    """The other end: starts the process and hands it jobs."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.process = subprocess.Popen(
            [sys.executable, __file__, str(folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        greeting = self._pipe(self.process.stdout).readline().strip()
        if greeting != READY:
            self.close()
            raise Unavailable(greeting or "the process ended before it was ready")

    def __call__(self, function: str, **arguments: Any) -> npt.NDArray[Any]:
        stdin = self._pipe(self.process.stdin)
        stdin.write(json.dumps([function, arguments]) + "\n")
        stdin.flush()
        answer = self._pipe(self.process.stdout).readline().strip()
        if not answer.endswith(".npy"):
            raise RuntimeError(f"Mitsuba could not do {function}({arguments}): {answer}")
        result: npt.NDArray[Any] = np.load(answer)
        return result

    def close(self) -> None:
        for pipe in (self.process.stdin, self.process.stdout):
            self._pipe(pipe).close()
        self.process.wait()

    @staticmethod
    def _pipe(pipe: IO[str] | None) -> IO[str]:
        assert pipe is not None
        return pipe


def render(folder: Path, scene: str, spp: int, seed: int, **options: Any) -> Any:
    """The picture of ``direct`` with one emitter sample; with ``aovs``, that of ``aov``."""
    import mitsuba as mi
    import object_scenes
    import render_scenes

    integrator: dict[str, Any] = {
        "type": "direct",
        "emitter_samples": 1,
        "bsdf_samples": 0,
        "hide_emitters": options.get("hide_emitters", False),
    }
    if "aovs" in options:
        integrator = {"type": "aov", "aovs": options["aovs"]}
    # Merging meshes would make the order of emitters differ from run to run.
    description = (
        object_scenes.SCENES[scene]()
        if scene in object_scenes.SCENES
        else render_scenes.SCENES[scene](folder)
    )
    loaded = mi.load_dict(description, optimize=False)
    return mi.render(loaded, integrator=mi.load_dict(integrator), spp=spp, seed=seed)


def render_file(
    folder: Path,
    path: str,
    spp: int,
    seed: int,
    bsdf_samples: int = 0,
    emitter_samples: int = 1,
) -> Any:
    """The picture of ``direct``, of a scene file."""
    import mitsuba as mi

    counts = {"emitter_samples": emitter_samples, "bsdf_samples": bsdf_samples}
    integrator = {"type": "direct", **counts}
    loaded = mi.load_file(path, optimize=False)
    return mi.render(loaded, integrator=mi.load_dict(integrator), spp=spp, seed=seed)


def sampler(folder: Path, seed: int, samples: int, size: int, dimensions: int) -> Any:
    """Numbers of the sampler ``independent``: shape (size, dimensions)."""
    import mitsuba as mi

    independent = mi.load_dict({"type": "independent", "sample_count": samples})
    independent.set_samples_per_wavefront(samples)
    independent.seed(seed, size)
    return np.stack([np.array(independent.next_1d()) for _ in range(dimensions)], axis=1)


def sampler_pairs(
    folder: Path, plugin: dict[str, Any], seed: int, pixels: int, drawn: list[int]
) -> Any:
    """Pairs of numbers of any sampler: shape (pixels * samples, numbers). For each 1 in
    `drawn` a single number is drawn and left out, for each 2 a pair."""
    import mitsuba as mi

    instance = mi.load_dict(plugin)
    samples = instance.sample_count()
    size = pixels * samples
    instance.set_samples_per_wavefront(samples)
    instance.seed(seed, size)
    columns = []
    for count in drawn:
        if count == 1:
            instance.next_1d()
            continue
        pair = instance.next_2d()
        columns += [np.broadcast_to(np.array(x), size) for x in (pair.x, pair.y)]
    return np.stack(columns, axis=1)


def image_block(
    folder: Path, filter: dict[str, Any], size: list[int], offset: list[int], samples: Any
) -> Any:
    """Weighted sums and weights, shape (H, W, 2), of rows x, y, value."""
    import mitsuba as mi

    block = mi.ImageBlock(size, offset, 2, rfilter=mi.load_dict(filter), border=False)
    columns = np.array(samples, np.float32).T.copy()
    x, y, value = (mi.Float(column.copy()) for column in columns)
    block.put(mi.Point2f(x, y), [value, mi.Float(1)])
    return block.tensor()


def nearest_hits(folder: Path, arrays: str, robust: bool) -> Any:
    """What Mitsuba's Embree hits of one mesh: shape (2, N), distances (inf) and faces (-1).

    arrays: an .npz file of vertices, faces, origins and directions.
    """
    import mitsuba as mi

    given = np.load(arrays)
    mesh = mi.Mesh("mesh", len(given["vertices"]), len(given["faces"]))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = given["vertices"].ravel()
    parameters["faces"] = given["faces"].ravel()
    parameters.update()
    scene = mi.load_dict(
        {"type": "scene", "mesh": mesh, "embree_use_robust_intersections": robust}
    )
    o, d = (np.ascontiguousarray(given[name].T) for name in ("origins", "directions"))
    hits = scene.ray_intersect_preliminary(mi.Ray3f(mi.Point3f(o), mi.Vector3f(d)))
    valid = np.array(hits.is_valid())
    return np.where(valid, [np.array(hits.t), np.array(hits.prim_index)], [[np.inf], [-1]])


def main(folder: Path) -> None:
    from mlrt_compare import llvm

    # Mitsuba's log goes where the answers would, past Python.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    try:
        llvm.activate()
        import mitsuba as mi

        mi.set_variant("llvm_ad_rgb")
        # Its log goes to standard output, where the answers are.
        mi.set_log_level(mi.LogLevel.Error)
    except (llvm.LlvmUnavailable, ImportError) as error:
        print(" ".join(str(error).split()), file=answers, flush=True)
        return
    print(READY, file=answers, flush=True)
    functions = {
        "render": render,
        "render_file": render_file,
        "sampler": sampler,
        "sampler_pairs": sampler_pairs,
        "image_block": image_block,
        "nearest_hits": nearest_hits,
    }
    for number, line in enumerate(sys.stdin):
        name, arguments = json.loads(line)
        path = folder / f"reference-{number}.npy"
        try:
            np.save(path, np.array(functions[name](folder, **arguments)))
            print(path, file=answers, flush=True)
        except Exception as error:
            print(" ".join(str(error).split()) or repr(error), file=answers, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
