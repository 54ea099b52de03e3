// The object set as Python holds it.
#pragma once

#include "objects/object_set.h"

#include <memory>

namespace mlrt {

struct ObjectsHandle {
    std::shared_ptr<const ObjectSet> objects;
};

} // namespace mlrt
