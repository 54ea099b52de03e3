#include "mlrta/ray_order.h"

#include "base/check.h"
#include "base/morton.h"
#include "base/simd.h"
#include "mlrta/regroup.h"
#include "traverse/load_packet.h"
#include "traverse/parameter_interval.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

namespace mlrt {

namespace {

// A beam of rays in the order given may be so much wider than a square one of average area
// before all are sorted; chosen.
constexpr float WIDER = 2;

// The sum of the sides of a rectangle around rays that go to all sides: of the whole plane
// it is 4, and of half a sphere at least 3. Chosen.
constexpr float APART = 2;

// Cells along the longer side of the plane, as bits; of all of them, and of a ray's number.
constexpr uint32_t SIDE_BITS = 8, CELL_BITS = 2 * SIDE_BITS, NUMBER_BITS = 16;
static_assert(RayOrder::MOST_RAYS <= 1u << NUMBER_BITS && CELL_BITS + NUMBER_BITS == 32);

// Bits of a cell's number to leave out, so that a cell holds about SHARING rays.
uint32_t dropped_bits(uint32_t count) {
    constexpr uint32_t SHARING = 64; // chosen from 4, 16 and 256 by area lights and skies
    return CELL_BITS - std::min<uint32_t>(std::bit_width(count / SHARING), CELL_BITS);
}

// The rectangle around points, lane by lane.
struct Extent {
    FloatPacket lo_x{INFINITE}, lo_y{INFINITE}, hi_x{-INFINITE}, hi_y{-INFINITE};

    void add(const FloatPacket &x, const FloatPacket &y) {
        lo_x = minimum(x, lo_x);
        lo_y = minimum(y, lo_y);
        hi_x = maximum(x, hi_x);
        hi_y = maximum(y, hi_y);
    }
    float width() const { return greatest_lane(hi_x) - least_lane(lo_x); }
    float height() const { return greatest_lane(hi_y) - least_lane(lo_y); }
};

// Where sixteen directions are in the plane, those of a group from `first` on. Within -1
// and 1, unless a direction is not finite, or zero.
Vec2<FloatPacket> load_in_plane(const RayGroup &rays, uint32_t first) {
    const FloatPacket zero(0.0f), one(1.0f);
    const FloatPacket dx = load_padded(rays.direction[0], first, rays.count);
    const FloatPacket dy = load_padded(rays.direction[1], first, rays.count);
    const FloatPacket dz = load_padded(rays.direction[2], first, rays.count);
    const FloatPacket scale = one / (absolute(dx) + absolute(dy) + absolute(dz));
    const FloatPacket x = dx * scale, y = dy * scale;
    const auto below = dz < zero;
    return {select(below, copy_sign(one - absolute(y), x), x),
            select(below, copy_sign(one - absolute(x), y), y)};
}

// The box around directions, lane by lane.
struct Box {
    Vec3<FloatPacket> lo = in_all_lanes({INFINITE, INFINITE, INFINITE});
    Vec3<FloatPacket> hi = in_all_lanes({-INFINITE, -INFINITE, -INFINITE});

    void add(const Vec3<FloatPacket> &least, const Vec3<FloatPacket> &greatest) {
        for (int k = 0; k < 3; ++k) {
            lo[k] = minimum(least[k], lo[k]);
            hi[k] = maximum(greatest[k], hi[k]);
        }
    }
    float longest_side() const {
        return max_component(
            by_axis([&](int k) { return greatest_lane(hi[k]) - least_lane(lo[k]); }));
    }
};

} // namespace

RayOrder::RayOrder(const RayGroup &rays) {
    MLRT_CHECK(rays.count <= MOST_RAYS);
    if (rays.count <= RayNumbers::CAPACITY)
        return;
    map_to_plane(rays);
    pays_ = is_scattered();
    if (pays_)
        sort(rays.has_common_origin ? 0 : dropped_bits(rays.count));
}

void RayOrder::map_to_plane(const RayGroup &rays) {
    count_ = rays.count;
    const size_t padded = (count_ + PACKET_WIDTH - 1) / PACKET_WIDTH * PACKET_WIDTH;
    x_.resize(padded);
    y_.resize(padded);
    const FloatPacket one(1.0f);
    Extent all;
    float valid_x = 0, valid_y = 0;
    for (uint32_t i = 0; i < count_; i += PACKET_WIDTH) {
        const auto [plane_x, plane_y] = load_in_plane(rays, i);
        store(&x_[i], plane_x);
        store(&y_[i], plane_y);
        const LaneBits valid =
            to_bits((absolute(plane_x) <= one) & (absolute(plane_y) <= one));
        if (valid != 0) {
            const uint32_t lane = uint32_t(__builtin_ctz(valid));
            valid_x = x_[i + lane];
            valid_y = y_[i + lane];
        }
        // Directions that are not finite, or zero, and lanes behind the last ray: any place
        // among the others will do.
        for_each_lane(ALL_LANES & ~valid, [&](uint32_t lane) {
            x_[i + lane] = valid_x;
            y_[i + lane] = valid_y;
        });
        all.add(load<FloatPacket>(&x_[i]), load<FloatPacket>(&y_[i]));
    }
    left_ = least_lane(all.lo_x);
    top_ = least_lane(all.lo_y);
    width_ = all.width();
    height_ = all.height();
}

// Compares the sum of the sides of the rectangles around consecutive rays with that of
// squares which would tile the rectangle around all.
bool RayOrder::is_scattered() const {
    constexpr uint32_t run = RayNumbers::CAPACITY;
    double sides = 0;
    for (uint32_t first = 0; first + run <= count_; first += run) {
        Extent extent;
        for (uint32_t i = first; i < first + run; i += PACKET_WIDTH)
            extent.add(load<FloatPacket>(&x_[i]), load<FloatPacket>(&y_[i]));
        sides += extent.width() + extent.height();
    }
    const double runs = count_ / run;
    const double square_side = std::sqrt(double(width_) * height_ / runs);
    return sides / runs > WIDER * 2 * square_side;
}

// A counting sort in two steps, by the lower and by the upper half of the bits of cells.
void RayOrder::sort(uint32_t dropped_bits) {
    constexpr uint32_t DIGITS = 1u << SIDE_BITS;
    constexpr std::array<uint32_t, 2> SHIFTS{NUMBER_BITS, NUMBER_BITS + SIDE_BITS};
    const auto digit = [](uint32_t key, uint32_t shift) {
        return key >> shift & (DIGITS - 1);
    };
    // Cells above numbers of rays, so that a step reads one array, and in its order.
    std::vector<uint32_t> keys = cells_and_numbers(dropped_bits);
    std::array<std::array<uint32_t, DIGITS>, 2> next{};
    for (uint32_t i = 0; i < count_; ++i)
        for (size_t step = 0; step < 2; ++step)
            ++next[step][digit(keys[i], SHIFTS[step])];
    for (auto &first : next)
        std::exclusive_scan(first.begin(), first.end(), first.begin(), 0u);
    std::vector<uint32_t> half_sorted(count_);
    for (uint32_t i = 0; i < count_; ++i)
        half_sorted[next[0][digit(keys[i], SHIFTS[0])]++] = keys[i];
    numbers_.resize(count_);
    for (const uint32_t key : half_sorted)
        numbers_[next[1][digit(key, SHIFTS[1])]++] = key & ((1u << NUMBER_BITS) - 1);
}

// The number of the cell of each ray, without its lowest bits, above that of the ray.
std::vector<uint32_t> RayOrder::cells_and_numbers(uint32_t dropped_bits) const {
    const float side = std::max(width_, height_);
    const FloatPacket scale = side > 0 ? float((1u << SIDE_BITS) - 1) / side : 0.0f;
    std::vector<uint32_t> keys(x_.size());
    for (uint32_t i = 0; i < count_; i += PACKET_WIDTH) {
        const UIntPacket column((load<FloatPacket>(&x_[i]) - left_) * scale);
        const UIntPacket row((load<FloatPacket>(&y_[i]) - top_) * scale);
        const UIntPacket cell = morton_code(column, row) >> dropped_bits;
        store(&keys[i], cell << NUMBER_BITS | (lane_indices() + i));
    }
    return keys;
}

bool are_in_order(const RayGroup &rays) {
    constexpr float NARROWER = 2; // of four times, as squares in order are; chosen
    constexpr uint32_t BEAM = RayNumbers::CAPACITY, SQUARE = 16 * BEAM;
    float sides = 0, wider_sides = 0;
    for (uint32_t first = 0; first < rays.count; first += SQUARE) {
        Box square;
        float beams = 0;
        const uint32_t end = std::min(first + SQUARE, rays.count);
        for (uint32_t i = first; i + BEAM <= end; i += BEAM, ++beams) {
            Box beam;
            for (uint32_t n = 0; n < BEAM; n += PACKET_WIDTH) {
                const Vec3<FloatPacket> direction = by_axis(
                    [&](int k) { return load<FloatPacket>(rays.direction[k] + i + n); });
                beam.add(direction, direction);
            }
            square.add(beam.lo, beam.hi);
            sides += beam.longest_side();
        }
        wider_sides += beams * square.longest_side();
    }
    return NARROWER * sides <= wider_sides;
}

bool go_apart(const RayGroup &rays) {
    constexpr uint32_t STEP = RayNumbers::CAPACITY;
    float sides = 0, packets = 0;
    for (uint32_t first = 0; first + PACKET_WIDTH <= rays.count; first += STEP) {
        const auto [x, y] = load_in_plane(rays, first);
        Extent extent;
        extent.add(x, y);
        // Less than nothing if no direction is valid.
        sides += std::max(extent.width() + extent.height(), 0.0f);
        ++packets;
    }
    return sides > APART * packets;
}

} // namespace mlrt
