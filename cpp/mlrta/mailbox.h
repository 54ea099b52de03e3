// Triangles that a beam has been tested against, as far as a small direct-mapped table
// remembers them.
#pragma once

#include <array>
#include <cstdint>

namespace mlrt {

class Mailbox {
public:
    // Forgets all, by a number that marks what is put in from now on.
    void clear() {
        beam_ += NEXT;
        if (beam_ != 0)
            return;
        // Numbers of long ago must not be taken for new ones.
        entries_.fill(0);
        beam_ = NEXT;
    }

    // Whether it was there already; it is from now on.
    bool put(uint32_t primitive) {
        uint64_t &entry = entries_[primitive % SIZE];
        const uint64_t mark = beam_ | primitive;
        const bool known = entry == mark;
        entry = mark;
        return known;
    }

private:
    static constexpr uint64_t NEXT = uint64_t(1) << 32;
    static constexpr uint32_t SIZE = 1024; // chosen from 64 to 2048
    std::array<uint64_t, SIZE> entries_{};
    uint64_t beam_ = 0; // in the upper half; never 0 once cleared
};

} // namespace mlrt
