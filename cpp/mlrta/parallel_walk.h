// The beam-leaf traversal for rays with a common direction.
#pragma once

#include "base/counters.h"
#include "mlrta/beam_packets.h"
#include "mlrta/beam_triangle_tests.h"

#include <array>
#include <cstdint>

namespace mlrt {

// Takes a beam of parallel rays through subtrees, front to back. Cells are left out that
// lie beside the beam, before it begins, or beyond all that its rays have found.
class ParallelWalk {
public:
    ParallelWalk(const KdTree &tree, const BeamPackets &beam,
                 BeamTriangleTests<Query::any> &tests, Counters &counters);

    // Returns false if the beam was given up.
    bool walk(const Entry &entry);

private:
    bool may_enter() const;

    const KdTree &tree_;
    const BeamPackets &beam_;
    BeamTriangleTests<Query::any> &tests_;
    Counters &counters_;
    std::array<float, 6> cell_; // lower and upper bounds relative to the beam's origin

    // The four sides of the beam: outside where normal.x > offset, which has some slack.
    Vec3<PointPacket> side_normals_;
    PointPacket side_offsets_;
    float begin_; // no ray begins at a lesser depth
    float depth_slack_;
    std::array<bool, 3> descends_; // by axis, whether rays go towards lower coordinates
};

} // namespace mlrt
