#include "kdtree/lazy.h"

#include "base/denormals.h"
#include "base/parallel.h"
#include "kdtree/relocate.h"
#include "kdtree/top.h"

#include <algorithm>
#include <chrono>

namespace mlrt {

namespace {

// Cells of more references are split before the first ray comes, by all threads together:
// any ray enters one of the few, and others would wait for it.
constexpr uint64_t MAX_TOP_REFERENCES = 1 << 20;

// Cells of up to this many references are built at once: the time to split them step by
// step would exceed what is saved. Chosen by measurement.
constexpr uint64_t MAX_WHOLE_REFERENCES = 64;

// Cells of more references are split before they are dealt out when all is to be built.
constexpr uint64_t MAX_FINISH_REFERENCES = 32768;

// Parts of larger cells stay in the list that they are split into.
constexpr uint64_t MAX_COPIED_REFERENCES = 32768;

// Room that is reserved for nodes, in proportion to that for references; memory is taken
// when it is used.
constexpr uint64_t NODES_PER_REFERENCE = 2;

} // namespace

LazyGrowth::LazyGrowth(KdTree &tree, const BuildFrame &frame)
    : options_(frame.options), frame_{options_, frame.scene_area, frame.area_floor},
      triangles_(tree.triangles.begin(), tree.triangles.end()),
      partitioner_(triangles_, options_.clip), nodes_(tree.nodes.data()),
      references_(tree.references.data()), max_nodes_(tree.nodes.capacity()),
      max_references_(tree.references.capacity()), node_count_(tree.nodes.size()),
      reference_count_(tree.references.size()), seeds_(0, max_nodes_),
      workspaces_(triangles_, options_, interruption_, MAX_COPIED_REFERENCES) {}

LazyGrowth::~LazyGrowth() {
    for (uint32_t i = 0; i < seed_count_; ++i)
        delete seeds_[i];
}

KdNode LazyGrowth::plant(const Box3f &cell, const Allowance &allowance,
                         const References &contents, SharedList list) {
    const uint64_t count = contents.count();
    if (list || count == 0)
        return plant(cell, allowance, contents, nullptr, std::move(list));
    auto own_list = std::make_unique_for_overwrite<Reference[]>(count);
    std::copy(contents.list.begin(), contents.list.end(), own_list.get());
    const References copied{{own_list.get(), count}, contents.bounds};
    return plant(cell, allowance, copied, std::move(own_list), nullptr);
}

KdNode LazyGrowth::plant(const Box3f &cell, const Allowance &allowance,
                         const References &contents, OwnList own_list,
                         SharedList shared_list) {
    const uint64_t count = contents.count();
    if (count == 0)
        return KdNode::leaf(0, 0);
    auto seed = std::make_unique<Seed>();
    seed->cell = cell;
    seed->allowance = allowance;
    seed->references = contents;
    seed->own_list = std::move(own_list);
    seed->shared_list = std::move(shared_list);
    if (count > MAX_COPIED_REFERENCES)
        seed->crew = std::make_unique<WaitingCrew>();
    const uint32_t number = seed_count_.fetch_add(1);
    seeds_[number] = seed.release();
    unbuilt_cells_.fetch_add(1, std::memory_order_relaxed);
    unbuilt_references_.fetch_add(count, std::memory_order_relaxed);
    return KdNode::unbuilt(number, count);
}

uint64_t LazyGrowth::take_nodes(uint64_t count) {
    const uint64_t first = node_count_.fetch_add(count);
    if (first + count > max_nodes_) {
        node_count_.fetch_sub(count);
        check_tree_size(KdNode::MAX_NODES + 1, 0);
    }
    return first;
}

uint64_t LazyGrowth::take_references(uint64_t count) {
    const uint64_t first = reference_count_.fetch_add(count);
    if (first + count > max_references_) {
        reference_count_.fetch_sub(count);
        check_tree_size(0, uint64_t(1) << 32);
    }
    return first;
}

KdNode LazyGrowth::build(uint32_t index, bool whole) {
    const KdNode node = load_node(nodes_[index]);
    if (!node.is_unbuilt())
        return node;
    const KeepDenormals keep_denormals;
    Seed &seed = *seeds_[node.number()];
    if (seed.claimed.exchange(true)) {
        if (seed.crew)
            seed.crew->help();
        else
            seed.finished.wait(false);
        if (seed.error)
            std::rethrow_exception(seed.error);
        return load_node(nodes_[index]);
    }
    try {
        publish_node(nodes_[index], grown(seed, whole));
        seed.own_list.reset();
        seed.shared_list.reset();
        unbuilt_cells_.fetch_sub(1, std::memory_order_relaxed);
        unbuilt_references_.fetch_sub(seed.count(), std::memory_order_relaxed);
    } catch (...) {
        seed.error = std::current_exception();
    }
    seed.finished.store(true);
    seed.finished.notify_all();
    if (seed.crew)
        seed.crew->finish();
    if (seed.error)
        std::rethrow_exception(seed.error);
    return load_node(nodes_[index]);
}

KdNode LazyGrowth::grown(Seed &seed, bool whole) {
    KdNode node;
    BuildReport report;
    Crew &crew = seed.crew ? *seed.crew : one_thread();
    FastChoice method{triangles_, options_, crew};
    Decision decision;
    whole = whole || seed.count() <= MAX_WHOLE_REFERENCES;
    if (!whole)
        decision = decide(method, seed.references, seed.cell, seed.allowance, frame_);
    if (whole || decision.kind == Decision::Kind::leaf || decision.bad) {
        node = whole_subtree(seed, report);
    } else {
        const auto [axis, position, planar_below] = decision.plane;
        const Box3f lower_cell = lower_part(seed.cell, axis, position);
        const Box3f upper_cell = upper_part(seed.cell, axis, position);
        const uint64_t children = take_nodes(2);
        ++report.inner_nodes;
        if (decision.kind == Decision::Kind::empty_cell) {
            const Box3f &full_cell = planar_below ? lower_cell : upper_cell;
            const KdNode full =
                plant(full_cell, decision.rest, seed.references, std::move(seed.own_list),
                      std::move(seed.shared_list));
            nodes_[children] = planar_below ? full : KdNode::leaf(0, 0);
            nodes_[children + 1] = planar_below ? KdNode::leaf(0, 0) : full;
            ++report.leaves;
            ++report.empty_leaves;
            ++report.empty_cell_splits;
        } else {
            Halves halves;
            if (seed.count() > MAX_COPIED_REFERENCES) {
                const Partitioner::OwnHalves own = partitioner_.split_together(
                    seed.references, seed.cell, decision.plane, crew, [](uint64_t count) {
                        return std::make_shared<HugeArray<Reference>>(count);
                    });
                nodes_[children] = plant(lower_cell, decision.rest, own.lower, own.list);
                nodes_[children + 1] =
                    plant(upper_cell, decision.rest, own.upper, own.list);
                halves = own;
            } else {
                std::unique_ptr<Workspace> workspace = workspaces_.take_for(seed.count());
                halves = partitioner_.split(seed.references, seed.cell, decision.plane,
                                            workspace->method.room_for(seed.count()));
                nodes_[children] = plant(lower_cell, decision.rest, halves.lower);
                nodes_[children + 1] = plant(upper_cell, decision.rest, halves.upper);
                workspaces_.give_back(std::move(workspace));
            }
            report.flat_cell_splits += decision.flat;
            for (const References &part : {halves.lower, halves.upper}) {
                report.leaves += part.count() == 0;
                report.empty_leaves += part.count() == 0;
            }
        }
        node = KdNode::inner(axis, position, uint32_t(children));
    }
    const std::lock_guard lock(report_mutex_);
    report_.add(report);
    return node;
}

KdNode LazyGrowth::whole_subtree(const Seed &seed, BuildReport &report) {
    std::unique_ptr<Workspace> workspace = workspaces_.take_for(seed.count());
    SubtreeArrays &arrays = workspace->arrays;
    arrays.nodes.assign(1, {});
    arrays.references.clear();
    SubtreeBuilder(workspace->method, frame_)
        .build(arrays, report, 0, seed.cell, {seed.references}, seed.allowance);
    const uint64_t first_node = take_nodes(arrays.nodes.size() - 1);
    const uint64_t first_reference = take_references(arrays.references.size());
    const KdNode root = relocate(arrays, first_node, first_reference, nodes_, references_);
    workspaces_.give_back(std::move(workspace));
    return root;
}

std::vector<uint32_t> LazyGrowth::unbuilt_nodes() const {
    std::vector<uint32_t> unbuilt, pending{0};
    while (!pending.empty()) {
        const uint32_t index = pending.back();
        pending.pop_back();
        const KdNode node = load_node(nodes_[index]);
        if (node.is_unbuilt())
            unbuilt.push_back(index);
        else if (!node.is_leaf())
            pending.insert(pending.end(), {node.lower_child() + 1, node.lower_child()});
    }
    return unbuilt;
}

bool LazyGrowth::finish(const std::function<bool()> &cancelled) {
    // Large cells are split first and finished in a later round, each part by a thread; and
    // rays of other threads may leave behind new cells.
    for (;;) {
        const std::vector<uint32_t> unbuilt = unbuilt_nodes();
        if (unbuilt.empty())
            return true;
        const auto build_one = [&](uint32_t i) {
            build(unbuilt[i],
                  load_node(nodes_[unbuilt[i]]).reference_count() <= MAX_FINISH_REFERENCES);
        };
        if (!parallel_for(uint32_t(unbuilt.size()), build_one, cancelled))
            return false;
    }
}

BuildReport LazyGrowth::report() const {
    const std::lock_guard lock(report_mutex_);
    return report_;
}

GrowthState LazyGrowth::state() const {
    return {node_count_.load(), reference_count_.load(), unbuilt_cells_.load(),
            unbuilt_references_.load(), unbuilt_references_.load() * sizeof(Reference)};
}

KdNode KdTree::built_node(uint32_t index) const {
    return growth->build(index, false);
}

bool finish_growth(const KdTree &tree, const std::function<bool()> &cancelled) {
    return !tree.growth || tree.growth->finish(cancelled);
}

void build_lazy(KdTree &tree, BuildReport &report, HugeArray<Reference> references,
                const BuildFrame &frame, const Interruption &interruption) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now();
    const uint64_t count = references.size();
    Top top = build_top(
        std::move(references), tree.bounds, {tree.triangles.begin(), tree.triangles.end()},
        whole_allowance(frame.options, count), frame, MAX_TOP_REFERENCES, interruption);
    report.add(top.report);

    const uint64_t max_references =
        std::min<uint64_t>(max_references_of(count), std::numeric_limits<uint32_t>::max());
    tree.references = HugeArray<uint32_t>(0, max_references);
    tree.nodes = HugeArray<KdNode>(
        top.nodes.size(),
        std::min<uint64_t>(KdNode::MAX_NODES, NODES_PER_REFERENCE * max_references));
    std::copy(top.nodes.begin(), top.nodes.end(), tree.nodes.begin());
    tree.growth = std::make_shared<LazyGrowth>(tree, frame);
    for (Remainder &part : top.remainders) {
        tree.nodes[part.node] =
            tree.growth->plant(part.cell, part.allowance, part.references, part.list);
        part.list.reset();
    }
    report.seconds_top = std::chrono::duration<double>(Clock::now() - start).count();
}

} // namespace mlrt
