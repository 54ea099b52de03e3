// The exact method: every face of the bounds of every reference is tried, in one pass over
// sorted events (Wald and Havran 2006).
#pragma once

#include "kdtree/events.h"
#include "kdtree/interruption.h"
#include "kdtree/rules.h"
#include "kdtree/subtree.h"
#include "kdtree/sweep.h"

namespace mlrt {

class SweepMethod {
public:
    using Contents = CellContents;

    struct Parts {
        Contents kept, lower, upper;
    };

    SweepMethod(std::span<const Triangle> triangles, const BuildOptions &options,
                const Interruption &interruption)
        : triangles_(triangles), options_(options), interruption_(interruption),
          splitter_(triangles, options.clip) {}

    // Whoever waits is asked whether to go on at cells of many references: they are few,
    // and what happens below one of the others takes well under a millisecond.
    void pause(const Contents &contents) const {
        if (contents.count() >= MIN_CANCELLABLE)
            interruption_.check();
    }

    std::optional<SplitPlane> largest_empty_part(const Contents &contents,
                                                 const Box3f &cell) const;
    std::optional<Choice> choose(const Contents &contents, const Box3f &cell);
    // `kept` is of use for for_each_triangle only, and empty unless asked for.
    Parts split(Contents contents, const Box3f &cell, const SplitPlane &plane, bool keep);

    template <typename Visit>
    void for_each_triangle(const Contents &contents, Visit &&visit) const {
        for (const Reference &reference : contents.references)
            visit(reference.triangle);
    }

    Contents nothing();
    void give_back(Contents contents);

private:
    static constexpr uint64_t MIN_CANCELLABLE = 256;

    std::span<const Triangle> triangles_;
    const BuildOptions &options_;
    const Interruption &interruption_;
    ContentsSplitter splitter_;
    SweepResult swept_;
    std::vector<CellContents> spare_;
};

} // namespace mlrt
