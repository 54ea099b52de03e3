// The references of one cell, and their bounds in sorted order along each axis.
#pragma once

#include "geometry/triangle.h"
#include "kdtree/reference.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace mlrt {

// Where the bounds of a reference begin or end along an axis, or both if they are flat.
// Wald and Havran 2006, section 4.2; at equal positions ends come first, starts last.
enum class EventType : uint32_t { end = 0, planar = 1, start = 2 };

class Event {
public:
    static constexpr uint64_t MAX_REFERENCES = 1u << 30;

    Event() = default;
    Event(float position, EventType type, uint32_t reference)
        : position_(position), code_((reference << 2) | uint32_t(type)) {}

    float position() const { return position_; }
    EventType type() const { return EventType(code_ & 3u); }
    uint32_t reference() const { return code_ >> 2; }

    // The order within the same position and type does not matter.
    friend bool operator<(const Event &a, const Event &b) {
        return a.position_ < b.position_ ||
               (a.position_ == b.position_ && (a.code_ & 3u) < (b.code_ & 3u));
    }

private:
    float position_;
    uint32_t code_;
};

struct CellContents {
    std::vector<Reference> references; // by increasing number of the triangle
    std::array<std::vector<Event>, 3>
        events; // sorted; two or one (planar) a reference and axis

    uint64_t count() const { return references.size(); }
};

// Sorts the events of `references`, whose bounds are given.
CellContents make_contents(std::vector<Reference> references);

// Distributes the contents of a cell to its two children in time linear in their number,
// plus sorting for what the plane cuts in two (Wald and Havran 2006, section 4.3).
//
// What has bounds below the plane goes to the lower child, above to the upper one, in it to
// one of them. So a triangle is left out of a child that it merely touches from the other
// side: each of its points still lies in a closed child that holds it.
class ContentsSplitter {
public:
    ContentsSplitter(std::span<const Triangle> triangles, bool clip)
        : triangles_(triangles), clip_(clip) {}

    void split(const CellContents &contents, const Box3f &cell, const SplitPlane &plane,
               CellContents &lower, CellContents &upper);

private:
    void add_part(const Box3f &part, uint32_t triangle, int side, CellContents &contents);

    std::span<const Triangle> triangles_;
    bool clip_;
    // Kept for their memory.
    std::vector<uint32_t> destinations_;
    std::array<std::array<std::vector<Event>, 3>, 2> fresh_;
};

} // namespace mlrt
