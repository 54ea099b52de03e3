// Triangles of leaves against a beam, then against its packets, and what remains against
// rays: the inner part of the beam-leaf traversal.
#pragma once

#include "base/counters.h"
#include "kdtree/tree.h"
#include "mlrta/beam_budget.h"
#include "mlrta/beam_packets.h"
#include "mlrta/hit_distances.h"
#include "mlrta/mailbox.h"
#include "mlrta/ray_grid.h"
#include "mlrta/triangle_forms.h"
#include "traverse/query.h"

#include <array>
#include <cstdint>
#include <span>

namespace mlrt {

// Keeps in the beam's packets what its rays have found. The group is the one that the beam
// was loaded from.
template <Query query>
class BeamTriangleTests {
public:
    BeamTriangleTests(const KdTree &tree, const RayGroup &rays, HitDistances &distances,
                      Mailbox &mailbox, const BeamBudget &budget, BeamPackets &beam,
                      Counters &counters)
        : tree_(tree), rays_(rays), distances_(distances), mailbox_(mailbox), beam_(beam),
          counters_(counters), budget_(budget) {
        mailbox_.clear();
        update_least();
    }

    // Tests up to WIDE_WIDTH triangles at once.
    void test_first(std::span<const uint32_t> primitives);
    // Tests the triangles of a leaf, or puts them off till the next call or flush().
    void test_leaf(KdNode leaf);
    // Tests those that were put off.
    void flush();

    // No ray has anything to find beyond this depth.
    float far_end() const { return far_end_; }
    // Whether no ray has anything to find at all.
    bool all_done() const { return least_ == INFINITY; }
    // Whether the beam had better be given up.
    bool spent() const { return budget_.spent(); }
    // Triangles that rays were found to hit, MOST_HIT of them at most: of Query::closest
    // those that were the nearest for some time.
    static constexpr uint32_t MOST_HIT =
        query == Query::any ? WIDE_WIDTH : HitDistances::MOST_PREPARED;
    std::span<const uint32_t> hit() const { return {hit_.data(), hit_count_}; }

private:
    void test_block(const uint32_t *numbers, uint32_t count);
    void cover(uint32_t run, const TriangleForms::Coverage &coverage,
               const TriangleForms &forms, uint32_t lane, uint32_t primitive);
    bool test_packet(uint32_t packet, const TriangleForms &forms, uint32_t lane,
                     uint32_t primitive);
    void test_unsafe(uint32_t primitive);
    // Rays that may hit a triangle nearer than all else; of those the ones that hit it for
    // certain if it is ahead, and the ones that have found nothing as near if they hit it.
    struct Seen {
        MaskOf<FloatPacket> possible = false, certain = false, nearer = false;
        FloatPacket lowest = 0.0f, highest = 0.0f; // bounds of its reciprocal depths
    };
    [[gnu::always_inline]] inline Seen see(uint32_t packet, const TriangleForms &forms,
                                           uint32_t lane) const;
    bool decide_open(uint32_t packet, const TriangleForms &forms, uint32_t lane,
                     uint32_t primitive, LaneBits open);
    void decide(uint32_t packet, LaneBits lanes, const Seen &seen, uint32_t primitive);
    void take(uint32_t packet, LaneBits lanes, const FloatPacket &lowest,
              const FloatPacket &highest, uint32_t primitive) {
        take(packet, from_bits<FloatPacket>(lanes), lanes, lowest, highest, primitive);
    }
    void take(uint32_t packet, const MaskOf<FloatPacket> &mask, LaneBits lanes,
              const FloatPacket &lowest, const FloatPacket &highest, uint32_t primitive);
    void decide_parallel(uint32_t packet, LaneBits lanes, LaneBits certain_hits,
                         uint32_t primitive);
    void update_least(const BeamPackets::Packets &packets);
    void update_least();

    const KdTree &tree_;
    const RayGroup &rays_;
    HitDistances &distances_;
    Mailbox &mailbox_;
    BeamPackets &beam_;
    Counters &counters_;
    BeamBudget budget_;
    uint32_t blocks_ = 0; // tested
    bool dense_ = false;  // whether there are many triangles
    RayGrid grid_;        // where there are
    // Packets of the beam that triangles of a block may touch; see block_pairs.h. What is
    // written there comes in whole packets.
    std::array<uint32_t, WIDE_WIDTH * BeamPackets::CAPACITY + PACKET_WIDTH> pairs_;
    std::array<uint32_t, 3 * WIDE_WIDTH> waiting_;
    uint32_t waiting_count_ = 0;
    std::array<uint32_t, MOST_HIT> hit_;
    uint32_t hit_count_ = 0;
    float least_ = 0; // of all rays
    float far_end_ = 0;
};

} // namespace mlrt
