// What threads need to build subtrees, kept from one to the next.
#pragma once

#include "kdtree/binned_method.h"

#include <memory>
#include <mutex>
#include <vector>

namespace mlrt {

struct Workspace {
    BinnedMethod method;
    SubtreeArrays arrays;
    uint64_t max_references;
};

class Workspaces {
public:
    // Those for cells of up to `max_references` are kept.
    Workspaces(std::span<const Triangle> triangles, const BuildOptions &options,
               const Interruption &interruption, uint64_t max_references)
        : triangles_(triangles), options_(options), interruption_(interruption),
          max_references_(max_references) {}

    std::unique_ptr<Workspace> take_for(uint64_t references) {
        if (references <= max_references_) {
            const std::lock_guard lock(mutex_);
            if (!idle_.empty()) {
                auto workspace = std::move(idle_.back());
                idle_.pop_back();
                return workspace;
            }
        }
        // Cells that could not be split may be larger than the others.
        const uint64_t room = std::max(references, max_references_);
        return std::make_unique<Workspace>(
            Workspace{BinnedMethod(triangles_, options_, interruption_, room), {}, room});
    }

    void give_back(std::unique_ptr<Workspace> workspace) {
        if (workspace->max_references > max_references_)
            return;
        const std::lock_guard lock(mutex_);
        idle_.push_back(std::move(workspace));
    }

private:
    std::span<const Triangle> triangles_;
    const BuildOptions &options_;
    const Interruption &interruption_;
    uint64_t max_references_;
    std::mutex mutex_;
    std::vector<std::unique_ptr<Workspace>> idle_;
};

} // namespace mlrt
