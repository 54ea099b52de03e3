// The lazy builder: a cell is split when the first beam or ray enters it.
//
// A node that is not built is a leaf with a mark (KdNode::unbuilt). Whoever enters it first
// builds it and publishes the result by replacing the node in one store, behind which all
// that it refers to is in place; others who come meanwhile wait for that node alone, and
// help if there is much to do. What is built is read without locks, as in any other tree.
//
// A cell is split by the same rules from the same references as by the fast builder: when
// all is built, both trees are equal but for the order of their nodes.
#pragma once

#include "kdtree/builder.h"
#include "kdtree/subtree.h"
#include "kdtree/workspaces.h"

#include <atomic>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

namespace mlrt {

// How far a lazy tree has grown.
struct GrowthState {
    uint64_t nodes = 0;         // that exist, unbuilt ones included
    uint64_t references = 0;    // of finished leaves
    uint64_t unbuilt_cells = 0; // without the empty ones, of which nothing is to build
    uint64_t unbuilt_references = 0;
    uint64_t waiting_bytes = 0; // of their references
};

class LazyGrowth {
public:
    // For the tree whose arrays are given, with all their capacity.
    LazyGrowth(KdTree &tree, const BuildFrame &frame);

    // A list that several cells have parts of.
    using SharedList = std::shared_ptr<const HugeArray<Reference>>;

    // A node in whose place the given references are to be built. They are copied, unless
    // the list that they lie in is given.
    KdNode plant(const Box3f &cell, const Allowance &allowance, const References &contents,
                 SharedList list = nullptr);

    // Room for `count` nodes or references behind those in use. Throws std::length_error.
    uint64_t take_nodes(uint64_t count);
    uint64_t take_references(uint64_t count);

    // Builds the node one step further, or all below it, unless another thread does;
    // returns it when it is not unbuilt any more. Throws what building it threw, in every
    // thread that asks.
    KdNode build(uint32_t index, bool whole);

    // Builds all that is not built, by all threads, whatever others ask for meanwhile.
    // Returns whether it was not cancelled, see finish_growth().
    bool finish(const std::function<bool()> &cancelled);

    // What was done since the tree was made; the figures of the whole tree are missing.
    BuildReport report() const;

    GrowthState state() const;

private:
    using OwnList = std::unique_ptr<Reference[]>;

    // What is to be built in place of a node.
    struct Seed {
        Box3f cell;
        Allowance allowance;
        References references;
        // One of both holds the references.
        OwnList own_list;
        SharedList shared_list;
        std::unique_ptr<WaitingCrew> crew; // of large cells
        std::atomic<bool> claimed{false};
        std::atomic<bool> finished{false};
        std::exception_ptr error;

        uint64_t count() const { return references.count(); }
    };

    KdNode plant(const Box3f &cell, const Allowance &allowance, const References &contents,
                 OwnList own_list, SharedList shared_list);
    KdNode grown(Seed &seed, bool whole);
    KdNode whole_subtree(const Seed &seed, BuildReport &report);
    std::vector<uint32_t> unbuilt_nodes() const;

    BuildOptions options_;
    BuildFrame frame_;
    std::function<bool()> never_cancelled_;
    Interruption interruption_{never_cancelled_};
    std::span<const Triangle> triangles_;
    Partitioner partitioner_;
    KdNode *nodes_;
    uint32_t *references_;
    uint64_t max_nodes_, max_references_;
    std::atomic<uint64_t> node_count_, reference_count_;
    std::atomic<uint64_t> unbuilt_cells_{0}, unbuilt_references_{0};

    HugeArray<Seed *> seeds_; // by number
    std::atomic<uint32_t> seed_count_{0};
    Workspaces workspaces_;
    mutable std::mutex report_mutex_;
    BuildReport report_;

public:
    ~LazyGrowth();
    LazyGrowth(const LazyGrowth &) = delete;
    LazyGrowth &operator=(const LazyGrowth &) = delete;
};

// Makes a tree of which only the uppermost cells are split. The rest is built in the course
// of its use.
void build_lazy(KdTree &tree, BuildReport &report, HugeArray<Reference> references,
                const BuildFrame &frame, const Interruption &interruption);

// Builds what a lazy tree has not built yet; does nothing for other trees. Returns whether
// it was not cancelled, which is asked on the calling thread only: what is built stays, and
// a cell that has begun is built to its end.
bool finish_growth(const KdTree &tree, const std::function<bool()> &cancelled = {});

} // namespace mlrt
