#include "kdtree/top.h"

#include "kdtree/binned_method.h"

namespace mlrt {

namespace {

// Arrays that are not needed any more, for those that will be: their pages are in place.
class SpareArrays {
public:
    using Array = std::shared_ptr<HugeArray<Reference>>;

    Array take(uint64_t count) {
        auto best = spare_.end();
        for (auto i = spare_.begin(); i != spare_.end(); ++i)
            if ((*i)->capacity() >= count &&
                (best == spare_.end() || (*i)->capacity() < (*best)->capacity()))
                best = i;
        if (best == spare_.end())
            return std::make_shared<HugeArray<Reference>>(count);
        Array array = std::move(*best);
        spare_.erase(best);
        return array;
    }

    // Keeps the array if nobody else needs it.
    void give_back(Array array) {
        if (array.use_count() == 1)
            spare_.push_back(std::move(array));
    }

private:
    std::vector<Array> spare_;
};

} // namespace

Top build_top(HugeArray<Reference> references, const Box3f &bounds,
              std::span<const Triangle> triangles, const Allowance &allowance,
              const BuildFrame &frame, uint64_t max_references,
              const Interruption &interruption) {
    FastChoice method{triangles, frame.options, all_threads()};
    const Partitioner partitioner(triangles, frame.options.clip);
    Top top;
    top.cells.push_back(bounds);
    SpareArrays spare;
    const auto allocate = [&](uint64_t count) { return spare.take(count); };
    std::vector<Remainder> pending;
    auto all = std::make_shared<HugeArray<Reference>>(std::move(references));
    const References whole{{all->begin(), all->end()}, bounds};
    pending.push_back({0, bounds, allowance, whole, std::move(all)});
    const auto add_node = [&](const Box3f &cell) {
        top.nodes.push_back({});
        top.cells.push_back(cell);
        return uint32_t(top.nodes.size() - 1);
    };
    while (!pending.empty()) {
        interruption.check();
        Remainder current = std::move(pending.back());
        pending.pop_back();
        Decision decision;
        if (current.references.count() > max_references)
            decision =
                decide(method, current.references, current.cell, current.allowance, frame);
        // What ends here for good, and what may be taken back, is left to who builds
        // subtrees.
        if (decision.kind == Decision::Kind::leaf || decision.bad) {
            top.nodes[current.node] = KdNode::leaf(0, 0);
            top.remainders.push_back(std::move(current));
            continue;
        }
        const auto [axis, position, planar_below] = decision.plane;
        const Box3f lower_cell = lower_part(current.cell, axis, position);
        const Box3f upper_cell = upper_part(current.cell, axis, position);
        const uint32_t lower = add_node(lower_cell), upper = add_node(upper_cell);
        top.nodes[current.node] = KdNode::inner(axis, position, lower);
        ++top.report.inner_nodes;
        if (decision.kind == Decision::Kind::empty_cell) {
            ++top.report.empty_cell_splits;
            ++top.report.leaves;
            ++top.report.empty_leaves;
            top.nodes[planar_below ? upper : lower] = KdNode::leaf(0, 0);
            pending.push_back({planar_below ? lower : upper,
                               planar_below ? lower_cell : upper_cell, decision.rest,
                               current.references, std::move(current.list)});
            continue;
        }
        top.report.flat_cell_splits += decision.flat;
        Partitioner::OwnHalves halves = partitioner.split_together(
            current.references, current.cell, decision.plane, all_threads(), allocate);
        spare.give_back(std::move(current.list));
        // The lower one is taken first.
        pending.push_back({upper, upper_cell, decision.rest, halves.upper, halves.list});
        pending.push_back({lower, lower_cell, decision.rest, halves.lower, halves.list});
    }
    return top;
}

} // namespace mlrt
