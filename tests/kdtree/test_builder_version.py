"""Trees in files are told apart by the builder's version: it has to change with them."""

from __future__ import annotations

import hashlib

import numpy as np
import workloads
from kd_trees import BuiltTree

from mlrt_plugin._dispatch import core

SEED = 20261125
OPTIONS = ({}, {"clip": False}, {"rule_flat_cell": False, "empty_bonus": 0.5})
VERSION = 1
DIGEST = "a26ac41aeb491df958b8334d38ef02343f3baed5e0954456d6ce9543e43e69ff"


def test_the_version_tells_what_is_built() -> None:
    rng = np.random.default_rng(SEED)
    scenes = [workloads.soup(rng, 300), workloads.flat(rng), workloads.sphere()]
    found = hashlib.sha256()
    for vertices, faces in scenes:
        for options in OPTIONS:
            tree = BuiltTree(vertices[faces], **options)
            for array in (*tree.arrays, tree.references):
                found.update(array.tobytes())
    assert (core.BUILDER_VERSION, found.hexdigest()) == (VERSION, DIGEST), (
        "builders give other trees than before: raise BUILDER_VERSION in "
        "cpp/kdtree/serialize.h, lest old files be taken for new ones, and note version "
        "and digest here"
    )
