// MLRT's side of a benchmark.
#pragma once

#include "base/counters.h"
#include "frame.h"
#include "kdtree/builder.h"
#include "kdtree/lazy.h"
#include "mesh.h"
#include "mlrta/trace.h"
#include "stopwatch.h"

#include <functional>

namespace mlrt::bench {

struct TimedTree {
    BuiltTree built;
    Seconds seconds; // from vertices and faces to the tree

    // Nodes and references so far, and what a lazy tree keeps for later.
    GrowthState state() const;
    uint64_t bytes() const;
};

// Returns nothing if it was cancelled.
std::optional<TimedTree> build_tree(const Mesh &mesh, const BuildOptions &options,
                                    const std::function<bool()> &cancelled);

struct WideForm {
    Seconds seconds;
    uint64_t bytes;
};

// Makes the form of the tree for rays that go alone, by all threads, and throws it away:
// the tree is as before.
WideForm make_wide_form(const KdTree &tree);

Seconds render_frame(const KdTree &tree, const View &view, const TraceOptions &options,
                     const FrameSettings &settings, const FrameOutput &output);

// What the builder's cost model expects of a line that crosses the scene.
double sah_cost(const KdTree &tree);

// What tracing the primary rays takes.
Counters count_primary(const KdTree &tree, const View &view, const TraceOptions &options,
                       uint32_t tile_side);

} // namespace mlrt::bench
