// What a traversal did. Counted per group of rays that is traced together, as in the paper;
// rays that go alone, through the kd-tree or the wide tree, are groups of their own, and
// nodes are those of either tree. A block of the wide tree counts as a leaf. Which beams
// are tried depends on those that the same thread traced before: so do counts, unlike hits.
#pragma once

#include <cstdint>

namespace mlrt {

struct Counters {
    uint64_t rays = 0;            // active rays
    uint64_t packets = 0;         // groups of up to 16 rays that were traced
    uint64_t entry_steps = 0;     // nodes visited by entry point searches, leaves included
    uint64_t traversal_steps = 0; // nodes visited by packets, leaves included
    uint64_t leaf_visits = 0;     // leaves visited by packets and beams
    uint64_t frontier_tests = 0;  // packets clipped to further cells of a frontier
    uint64_t triangle_tests = 0;  // packet against triangle
    uint64_t beams = 0;           // that went on to leaves (X4)
    uint64_t beam_steps = 0;      // nodes visited by them, leaves included
    uint64_t beam_blocks = 0;     // a few triangles side by side against a beam
    uint64_t beam_triangles = 0;  // triangles that a beam was found to meet
    uint64_t double_tests = 0; // ray against triangle that single precision left undecided
    uint64_t exact_distances = 0; // distances that double precision could not round
    uint64_t exact_tests = 0;     // ray against triangle that it left undecided
    uint64_t tiles = 0;           // for which an entry point was searched
    uint64_t missed_tiles = 0;    // that no leaf can hold a hit for
    uint64_t splits = 0;          // tiles that were split
    uint64_t fallbacks = 0;       // beams that say nothing, were given up, or not tried
    uint64_t blockers = 0;        // triangles found to cover a tile's beam
    uint64_t regrouped_rays = 0;  // rays laid out anew for smaller or tidier beams

    // What all of it took, counted alike: visits of nodes and tests of triangles.
    uint64_t work() const {
        return entry_steps + traversal_steps + beam_steps + triangle_tests + beam_triangles;
    }

    Counters &operator+=(const Counters &other) {
        rays += other.rays;
        packets += other.packets;
        entry_steps += other.entry_steps;
        traversal_steps += other.traversal_steps;
        leaf_visits += other.leaf_visits;
        frontier_tests += other.frontier_tests;
        triangle_tests += other.triangle_tests;
        beams += other.beams;
        beam_steps += other.beam_steps;
        beam_blocks += other.beam_blocks;
        beam_triangles += other.beam_triangles;
        double_tests += other.double_tests;
        exact_tests += other.exact_tests;
        exact_distances += other.exact_distances;
        tiles += other.tiles;
        missed_tiles += other.missed_tiles;
        splits += other.splits;
        fallbacks += other.fallbacks;
        blockers += other.blockers;
        regrouped_rays += other.regrouped_rays;
        return *this;
    }
};

} // namespace mlrt
