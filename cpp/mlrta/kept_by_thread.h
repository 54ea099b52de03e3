// What a thread learned from the tiles of a scene for those to come: neighbouring tiles are
// mostly traced by the same thread.
#pragma once

namespace mlrt {

// A Value of this thread for one Kind of use and one scene, new for another scene. One that
// takes the place of another in memory begins with what was kept of that: it must not
// matter to hits.
template <typename Kind, typename Value>
Value &kept_by_thread(const void *scene) {
    struct Kept {
        const void *scene = nullptr;
        Value value;
    };
    thread_local Kept kept;
    if (kept.scene != scene)
        kept = {scene, {}};
    return kept.value;
}

} // namespace mlrt
