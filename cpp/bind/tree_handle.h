// The tree as Python holds it.
#pragma once

#include "kdtree/builder.h"

#include <memory>

namespace mlrt {

struct TreeHandle {
    std::shared_ptr<const KdTree> tree;
    BuildReport report;
    BuildOptions options;
};

} // namespace mlrt
