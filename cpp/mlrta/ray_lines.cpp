#include "mlrta/ray_lines.h"

#include "base/check.h"
#include "base/morton.h"
#include "base/vec.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

namespace {

// Fewer rays gain less than the search takes; and as many lines there should be, so that no
// long part of the rays is searched for their ends. Chosen.
constexpr size_t FEWEST_RAYS = 4096, FEWEST_LINES = 8;

// Rays at the beginning that are searched first, and then twice as many each time.
constexpr size_t FIRST_WINDOW = 64;

// Lines have at least as many rays, and as many rays are looked at to make sure of them.
constexpr size_t SHORTEST_LINE = 16, SAMPLES = 64;

// How many lines apart neighbours are that are compared. They, and rays that follow one
// another in a line as many places apart, may lie as far from each other as this share of a
// line; a share of the samples may fail. Chosen.
constexpr size_t LINES_APART = 4;
constexpr float NEAR = 0.25f, MAY_FAIL = 0.125f;

float distance(const float *directions, size_t i, size_t j) {
    const auto of = [&](size_t ray) {
        return Vec3f{directions[3 * ray], directions[3 * ray + 1], directions[3 * ray + 2]};
    };
    return length(of(i) - of(j));
}

// Differences between sixteen values of directions and those of the next ray, the first one
// of which is value i.
FloatPacket steps_from(const float *directions, size_t i) {
    return absolute(load<FloatPacket>(directions + i + 3) -
                    load<FloatPacket>(directions + i));
}

// Where lines may end: the numbers of rays that are followed by one far from them.
class LineEnds {
public:
    explicit LineEnds(const float *directions) : directions_(directions) {}

    // Looks for them among the first rays, and the few behind those that share a packet
    // with them. Each time there must be more rays.
    void search(size_t rays) {
        FloatPacket largest = largest_;
        for (size_t i = 3 * searched_; i < 3 * rays; i += PACKET_WIDTH)
            largest = maximum(steps_from(directions_, i), largest);
        searched_ = rays;
        largest_ = greatest_lane(largest);
        ends_.clear();
        const FloatPacket jump = 0.5f * largest_;
        const size_t most = std::max<size_t>(rays / SHORTEST_LINE, 2);
        for (size_t i = 0; i < 3 * rays && ends_.size() <= most; i += PACKET_WIDTH)
            for_each_lane(to_bits(steps_from(directions_, i) > jump), [&](uint32_t lane) {
                const size_t ray = (i + lane) / 3;
                if (ends_.empty() || ends_.back() != ray)
                    ends_.push_back(ray);
            });
    }

    // Whether they are as far apart as lines are long.
    bool are_regular() const {
        if (ends_.size() < 2 || length() < SHORTEST_LINE || ends_[0] >= length())
            return false;
        for (size_t i = 1; i < ends_.size(); ++i)
            if (ends_[i] - ends_[i - 1] != length())
                return false;
        return true;
    }
    size_t length() const { return ends_[1] - ends_[0]; }
    size_t first() const { return ends_[0]; }

private:
    const float *directions_;
    size_t searched_ = 0;
    float largest_ = 0;
    std::vector<size_t> ends_;
};

} // namespace

std::optional<RayLines> RayLines::find(const float *directions, size_t count) {
    if (count < FEWEST_RAYS)
        return std::nullopt;
    LineEnds ends(directions);
    for (size_t window = FIRST_WINDOW; window <= count / FEWEST_LINES; window *= 2) {
        ends.search(window);
        if (!ends.are_regular())
            continue;
        RayLines lines(count, ends.length(), ends.length() - 1 - ends.first());
        if (lines.agree_with(directions,
                             distance(directions, ends.first(), ends.first() + 1)))
            return lines;
    }
    return std::nullopt;
}

// Whether rays from all over the array are near their neighbours, in lines of the given
// width. Measures how square tiles are.
bool RayLines::agree_with(const float *directions, float width) {
    MLRT_CHECK(line_count() > LINES_APART);
    // The golden ratio in units of 2^-32: fractions of its multiples are spread evenly.
    constexpr uint32_t GOLDEN = 0x9e3779b9;
    const size_t apart = LINES_APART * length_;
    const float near = NEAR * width;
    size_t good = 0;
    double sum = 0;
    for (uint32_t n = 0; n < SAMPLES; ++n) {
        const double share = (double(n) + 0x1p-32 * double(n * GOLDEN)) / SAMPLES;
        const auto ray = size_t(share * double(count_ - apart - LINES_APART));
        // Of rays behind it, since the first one of all may be the last one of its line.
        const size_t next = ray + apart;
        const bool at_end = (ray + lacking_) % length_ + LINES_APART >= length_;
        const size_t beside = at_end ? next - LINES_APART : next + LINES_APART;
        const float across = distance(directions, ray, next);
        if (across <= near && distance(directions, next, beside) <= near) {
            ++good;
            sum += across;
        } else if (float(n + 1 - good) > MAY_FAIL * SAMPLES) {
            return false;
        }
    }
    set_tiles(sum / double(good * LINES_APART), width / double(length_ - 1));
    return true;
}

void RayLines::set_tiles(double distance_across, double distance_along) {
    constexpr double MOST = 6; // squares are one line high
    static_assert(ImageTile::SIDE == 1u << uint32_t(MOST));
    constexpr size_t ENOUGH_TILES = 16; // for all threads to have work; chosen
    const double stretch = 0.5 * std::log2(distance_across / distance_along);
    stretch_ = uint32_t(std::lround(std::min(std::max(stretch, 0.0), MOST)));
    squares_ = uint32_t(std::clamp<size_t>(count_ / ENOUGH_TILES / ImageTile::SQUARE, 1,
                                           ImageTile::MOST_SQUARES));
    tile_width_ = size_t(ImageTile::SIDE << stretch_) * squares_;
    tile_height_ = ImageTile::SIDE >> stretch_;
    tiles_along_ = uint32_t((length_ + tile_width_ - 1) / tile_width_);
    tiles_across_ = uint32_t((line_count() + tile_height_ - 1) / tile_height_);
}

ImageTile RayLines::tile(uint32_t number) const {
    const uint32_t packet_stretch = std::min(stretch_, 2u);
    const uint32_t width = PACKET_SIDE << packet_stretch;
    const uint32_t height = PACKET_SIDE >> packet_stretch;
    // Packets cannot be wider: as many make up a square, side by side, as two to the power
    // of it.
    const uint32_t side_by_side = 2 * (stretch_ - packet_stretch);
    const size_t left = number % tiles_along_ * tile_width_;
    const size_t top = number / tiles_along_ * tile_height_;
    ImageTile tile;
    tile.packet_width_ = width;
    tile.packets_along_ = uint32_t(tile_width_ / width);
    tile.packet_rows_ = uint32_t(tile_height_ / height);
    MLRT_CHECK(tile.packet_rows_ * tile.packets_along_ <= ImageTile::MOST_PACKETS);
    tile.first_ = uint32_t(top * length_ + left - lacking_);
    tile.line_step_ = uint32_t(length_);
    const size_t right = std::min(left + tile_width_, length_);
    for (size_t line = top; line < std::min(top + tile_height_, line_count()); ++line) {
        const size_t begin = std::max(line * length_ + left, lacking_);
        const size_t end = std::min(line * length_ + right, lacking_ + count_);
        if (begin < end)
            tile.lines_[tile.line_count_++] = {uint32_t(begin - lacking_),
                                               uint32_t(end - begin)};
    }
    // Packets along the curve, as columns and rows of packets.
    constexpr uint32_t PACKETS = ImageTile::SQUARE / PACKET_WIDTH;
    const auto packet = [&](uint32_t n) -> MortonPoint {
        const MortonPoint point = of_morton_code(n % PACKETS >> side_by_side);
        return {n / PACKETS * (tile.packets_along_ / squares_) +
                    (point.column << side_by_side) + n % (1u << side_by_side),
                point.row};
    };
    const auto first_of = [&](MortonPoint p) { // and as many as lack
        return (top + p.row * height) * length_ + left + p.column * width;
    };
    tile.packets_.fill(ImageTile::NONE);
    const auto number_of = [&](MortonPoint p) -> uint32_t & {
        return tile.packets_[p.row * tile.packets_along_ + p.column];
    };
    const uint32_t packets = squares_ * PACKETS;
    // Beams and their tiles are runs of rays: parts of squares that have all rays come
    // first, larger ones before smaller ones, so that each of them is such a run.
    for (uint32_t size = PACKETS; size > 0; size /= 4)
        for (uint32_t n = 0; n < packets && tile.packet_count_ < packets; n += size) {
            const MortonPoint one = packet(n), other = packet(n + size - 1);
            const size_t last = first_of(other) + (height - 1) * length_ + width - 1;
            if (number_of(one) == ImageTile::NONE && first_of(one) >= lacking_ &&
                last < lacking_ + count_ && left + (other.column + 1) * width <= length_)
                for (uint32_t i = n; i < n + size; ++i) {
                    number_of(packet(i)) = tile.packet_count_;
                    tile.first_of_packet_[tile.packet_count_++] =
                        uint32_t(first_of(packet(i)) - lacking_);
                }
        }
    for (uint32_t n = 0; n < packets && tile.packet_count_ < packets; ++n) {
        const MortonPoint p = packet(n);
        if (number_of(p) != ImageTile::NONE)
            continue;
        for (size_t line = 0; line < height; ++line)
            for (size_t i = 0; i < width && left + p.column * width + i < length_; ++i) {
                const size_t ray = first_of(p) + line * length_ + i;
                if (ray >= lacking_ && ray < lacking_ + count_)
                    tile.others_.push_back(uint32_t(ray - lacking_));
            }
    }
    return tile;
}

void ImageTile::copy_columns(const float *rows, const std::array<float *, 3> &to) const {
    const auto quarter = [&](uint32_t i) {
        const uint32_t place = i * QUARTER_WIDTH;
        return size_t(place / packet_width_ * line_step_ + place % packet_width_);
    };
    const std::array<size_t, QUARTERS> quarters{quarter(0), quarter(1), quarter(2),
                                                quarter(3)};
    for (uint32_t n = 0; n < packet_count_; ++n) {
        std::array<const float *, QUARTERS> places;
        for (size_t i = 0; i < QUARTERS; ++i)
            places[i] = rows + 3 * (first_of_packet_[n] + quarters[i]);
        const std::array<FloatPacket, 3> columns = load_three_columns(places);
        for (size_t k = 0; k < 3; ++k)
            store(to[k] + n * PACKET_WIDTH, columns[k]);
    }
    uint32_t place = packet_count_ * PACKET_WIDTH;
    for (const uint32_t ray : others_) {
        for (size_t k = 0; k < 3; ++k)
            to[k][place] = rows[3 * size_t(ray) + k];
        ++place;
    }
}

} // namespace mlrt
