"""Trees in files are told apart by the builder's version: it has to change with them."""

from __future__ import annotations

import hashlib
import itertools
from typing import Any

import numpy as np
import workloads
from kd_trees import BuiltTree

from mlrt_plugin._dispatch import core

SEED = 20261125
OPTIONS: tuple[dict[str, Any], ...] = (
    {},
    {"clip": False},
    {"rule_flat_cell": False, "empty_bonus": 0.5},
)
VERSION = 2
DIGEST = "3537160cc14cba9843f0bb06c2dc927d0b2d361ed9ae84d3d89936662cb6eca3"


def test_the_version_tells_what_is_built() -> None:
    rng = np.random.default_rng(SEED)
    scenes = [workloads.soup(rng, 3000), workloads.flat(rng), workloads.sphere()]
    found = hashlib.sha256()
    for vertices, faces in scenes:
        for builder, options in itertools.product(("exact", "fast"), OPTIONS):
            tree = BuiltTree(
                vertices[faces], builder=builder, intersection_cost=1.5, **options
            )
            for array in (*tree.arrays, tree.references):
                found.update(array.tobytes())
    assert (core.BUILDER_VERSION, found.hexdigest()) == (VERSION, DIGEST), (
        "builders give other trees than before: raise BUILDER_VERSION in "
        "cpp/kdtree/serialize.h, lest old files be taken for new ones, and note version "
        "and digest here"
    )
