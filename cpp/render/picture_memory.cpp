#include "render/picture_memory.h"

#include "base/huge_array.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <iterator>
#include <mutex>
#include <vector>

namespace mlrt {

namespace {

// Below, the C library's own store of memory serves; chosen.
constexpr uint64_t LEAST_KEPT = uint64_t(1) << 20;

class PictureMemory {
public:
    // Room for all that there can be, so that keeping never fails.
    PictureMemory() { kept_.reserve(MOST_KEPT_PICTURE_BYTES / LEAST_KEPT); }

    // Null if there is none of that size.
    void *take(uint64_t bytes) {
        const std::lock_guard lock(mutex_);
        const auto last = std::find_if(kept_.rbegin(), kept_.rend(),
                                       [&](const Block &b) { return b.bytes == bytes; });
        if (last == kept_.rend())
            return nullptr;
        void *memory = last->memory;
        bytes_ -= bytes;
        kept_.erase(std::next(last).base());
        return memory;
    }

    void keep(void *memory, uint64_t bytes) {
        const std::lock_guard lock(mutex_);
        size_t freed = 0;
        for (; bytes_ + bytes > MOST_KEPT_PICTURE_BYTES; ++freed) {
            bytes_ -= kept_[freed].bytes;
            std::free(kept_[freed].memory);
        }
        kept_.erase(kept_.begin(), kept_.begin() + ptrdiff_t(freed));
        kept_.push_back({memory, bytes});
        bytes_ += bytes;
    }

    uint64_t bytes() {
        const std::lock_guard lock(mutex_);
        return bytes_;
    }

private:
    struct Block {
        void *memory;
        uint64_t bytes;
    };
    std::mutex mutex_;
    std::vector<Block> kept_; // what has been given back longest ago comes first
    uint64_t bytes_ = 0;
};

// Never destroyed: arrays of Python may outlive all that is static.
PictureMemory &picture_memory() {
    static PictureMemory &memory = *new PictureMemory;
    return memory;
}

bool is_kept(uint64_t bytes) {
    return bytes >= LEAST_KEPT && bytes <= MOST_KEPT_PICTURE_BYTES;
}

} // namespace

void *take_picture_memory(uint64_t bytes) {
    void *memory = is_kept(bytes) ? picture_memory().take(bytes) : nullptr;
    return memory ? memory : allocate_aligned(bytes);
}

void give_back_picture_memory(void *memory, uint64_t bytes) noexcept {
    if (is_kept(bytes))
        picture_memory().keep(memory, bytes);
    else
        std::free(memory);
}

uint64_t kept_picture_bytes() {
    return picture_memory().bytes();
}

} // namespace mlrt
