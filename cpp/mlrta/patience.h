// Whether beams pay where a thread traces, or rays had better go another way at once.
#pragma once

#include "mlrta/kept_by_thread.h"

#include <algorithm>
#include <cstdint>

namespace mlrt {
// A beam takes long until it is known that it meets a dense surface. Surfaces go on: after
// two such beams in a row the next one is not tried, after another one the next three, and
// so on, until one pays.
class Patience {
public:
    // Whether the next beam should not be tried.
    bool spares() const { return left_ > 0; }
    // The same, and counts it.
    bool spares_next() {
        if (left_ == 0)
            return false;
        --left_;
        return true;
    }

    // What came of one that was tried.
    void lose() {
        left_ = spared_;
        spared_ = std::min(2 * spared_ + 1, MOST_SPARED);
    }
    void win() { spared_ = 0; }

private:
    // Chosen; half of it takes up to 4 % longer in dragon.
    static constexpr uint32_t MOST_SPARED = 32;

    uint32_t spared_ = 0; // beams after the next one that is lost
    uint32_t left_ = 0;   // of those after the last one
};

// That of this thread, for one kind of beams in one tree.
template <typename Kind>
Patience &patience_of_thread(const KdTree &tree) {
    return kept_by_thread<Kind, Patience>(tree);
}

} // namespace mlrt
