// The fast method: planes from bins, or by counting where references are few. Contents are
// plain lists on a stack.
#pragma once

#include "kdtree/bins.h"
#include "kdtree/few_references.h"
#include "kdtree/interruption.h"
#include "kdtree/partition.h"
#include "kdtree/subtree.h"

namespace mlrt {

// The planes of a cell by the fast method.
std::optional<Choice> choose_fast(const References &references, const Box3f &cell,
                                  std::span<const Triangle> triangles,
                                  const BuildOptions &options, Crew &crew);

// The fast method as far as `decide` needs it, for lists of any size.
struct FastChoice {
    using Contents = References;

    std::span<const Triangle> triangles;
    const BuildOptions &options;
    Crew &crew;

    std::optional<SplitPlane> largest_empty_part(const References &contents,
                                                 const Box3f &cell) const {
        return mlrt::largest_empty_part(contents.bounds, cell, options);
    }
    std::optional<Choice> choose(const References &contents, const Box3f &cell) const {
        return choose_fast(contents, cell, triangles, options, crew);
    }
};

class BinnedMethod {
public:
    // References in a list of somebody else or on the stack.
    struct Contents : References {
        uint64_t stack_before = NOT_SPLIT; // level of the stack before it was split
    };

    struct Parts {
        Contents kept, lower, upper;
    };

    // For cells of up to `max_references`.
    BinnedMethod(std::span<const Triangle> triangles, const BuildOptions &options,
                 const Interruption &interruption, uint64_t max_references);

    void pause(const Contents &contents) const {
        if (contents.count() >= MIN_CANCELLABLE)
            interruption_.check();
    }

    std::optional<SplitPlane> largest_empty_part(const Contents &contents,
                                                 const Box3f &cell) const {
        return mlrt::largest_empty_part(contents.bounds, cell, options_);
    }
    std::optional<Choice> choose(const Contents &contents, const Box3f &cell) const {
        return choose_fast(contents, cell, triangles_, options_, one_thread());
    }
    Parts split(Contents contents, const Box3f &cell, const SplitPlane &plane, bool keep);

    template <typename Visit>
    void for_each_triangle(const Contents &contents, Visit &&visit) const {
        for (const Reference &reference : contents.list)
            visit(reference.triangle);
    }

    // Room for the parts of `count` references, while the stack is empty.
    Reference *room_for([[maybe_unused]] uint64_t count) {
        MLRT_CHECK(stack_.empty() && 2 * count <= stack_.capacity());
        return stack_.data();
    }

    Contents nothing() const { return {}; }
    void give_back(const Contents &contents) {
        if (contents.stack_before != NOT_SPLIT)
            stack_.set_size(contents.stack_before);
    }

private:
    static constexpr uint64_t NOT_SPLIT = ~uint64_t(0);
    static constexpr uint64_t MIN_CANCELLABLE = 1024;

    std::span<const Triangle> triangles_;
    const BuildOptions &options_;
    const Interruption &interruption_;
    Partitioner partitioner_;
    HugeArray<Reference> stack_;
};

} // namespace mlrt
