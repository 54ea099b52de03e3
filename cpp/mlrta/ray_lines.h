// Rays that come line by line of an image, as those of a camera mostly do: row by row from
// above or from below, or column by column. Squares of such an image are found by counting,
// where rays in any order would have to be sorted.
#pragma once

#include "base/quarters.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

namespace mlrt {

// Rays of an image, of a few squares side by side in Morton order: first those of whole
// squares, then those of whole quarters and sixteenths, of whole packets, and at last those
// at the border of the image that do not fill one. Known by their numbers in the array of
// all rays.
class ImageTile {
public:
    static constexpr uint32_t SIDE = 64; // of a square
    static constexpr uint32_t SQUARE = SIDE * SIDE, MOST_SQUARES = 4;
    static constexpr uint32_t MOST_RAYS = MOST_SQUARES * SQUARE;

    uint32_t count() const {
        return packet_count_ * PACKET_WIDTH + uint32_t(others_.size());
    }
    size_t first_ray() const { return lines_[0].first; } // if there is any

    // Whether condition(first ray, how many) is true of the parts of lines that the rays
    // are those of.
    template <typename Condition>
    bool all_lines(Condition &&condition) const {
        for (uint32_t n = 0; n < line_count_; ++n)
            if (!condition(size_t(lines_[n].first), size_t(lines_[n].count)))
                return false;
        return true;
    }

    // The columns of rows of three values: `to` has room for count() in each.
    void copy_columns(const float *rows, const std::array<float *, 3> &to) const;

    // Values of the rays in the order of the tile, from an array of all and to such a one.
    template <typename Value>
    void copy_from(const Value *all, Value *ordered) const {
        for_each_quarter([&](uint32_t ray, uint32_t place) {
            std::memcpy(ordered + place, all + ray, QUARTER_WIDTH * sizeof(Value));
        });
        uint32_t place = packet_count_ * PACKET_WIDTH;
        for (const uint32_t ray : others_)
            ordered[place++] = all[ray];
    }
    template <typename Value>
    void copy_to(const Value *ordered, Value *all) const {
        for_each_quarter([&](uint32_t ray, uint32_t place) {
            std::memcpy(all + ray, ordered + place, QUARTER_WIDTH * sizeof(Value));
        });
        uint32_t place = packet_count_ * PACKET_WIDTH;
        for (const uint32_t ray : others_)
            all[ray] = ordered[place++];
    }

private:
    friend class RayLines;

    static constexpr uint32_t MOST_PACKETS = MOST_RAYS / PACKET_WIDTH;
    static constexpr uint32_t NONE = 0xffffffff;

    // Calls visit(first ray, place in the tile) for the quarters of all packets, in the
    // order of memory.
    template <typename Visit>
    void for_each_quarter(Visit &&visit) const {
        if (packet_width_ == PACKET_WIDTH)
            for_each_quarter_of<PACKET_WIDTH>(visit);
        else if (packet_width_ == 2 * QUARTER_WIDTH)
            for_each_quarter_of<2 * QUARTER_WIDTH>(visit);
        else
            for_each_quarter_of<QUARTER_WIDTH>(visit);
    }
    template <uint32_t WIDTH, typename Visit>
    void for_each_quarter_of(Visit &&visit) const {
        constexpr uint32_t HEIGHT = PACKET_WIDTH / WIDTH;
        for (uint32_t row = 0; row < packet_rows_; ++row) {
            const uint32_t *begin = &packets_[row * packets_along_];
            const uint32_t *end = begin + packets_along_;
            uint32_t first = first_ + row * HEIGHT * line_step_;
            for (; begin < end && *begin == NONE; ++begin)
                first += WIDTH;
            while (begin < end && end[-1] == NONE)
                --end;
            for (uint32_t line = 0; line < HEIGHT; ++line, first += line_step_) {
                uint32_t ray = first;
                for (const uint32_t *packet = begin; packet < end; ++packet)
                    for (uint32_t i = 0; i < WIDTH; i += QUARTER_WIDTH) {
                        visit(ray, *packet * PACKET_WIDTH + line * WIDTH + i);
                        ray += QUARTER_WIDTH;
                    }
            }
        }
    }

    struct Line {
        uint32_t first, count;
    };

    uint32_t line_count_ = 0;
    std::array<Line, SIDE> lines_;

    uint32_t packet_count_ = 0;
    std::array<uint32_t, MOST_PACKETS> first_of_packet_; // in the order of the tile
    // Which packet of the tile it is, or NONE, row by row. Those that there are in a row
    // stand side by side.
    std::array<uint32_t, MOST_PACKETS> packets_;
    uint32_t packet_width_ = 0; // in rays of a line
    uint32_t packets_along_ = 0, packet_rows_ = 0;

    // The ray in the upper left corner and how many there are to the one below it, modulo
    // 2^32: there need be no such ray.
    uint32_t first_ = 0, line_step_ = 0;
    std::vector<uint32_t> others_;
};

// Lines of equal length, one after another. The first one may lack rays at its beginning,
// the last one at its end.
class RayLines {
public:
    // Recognises lines by their directions, rows of three values: where they jump, always
    // after the same number of rays, to nearly where they were a line before. Looks at some
    // of the rays only, so that others may be anywhere.
    static std::optional<RayLines> find(const float *directions, size_t count);

    // Tiles that all rays are in.
    uint32_t tile_count() const { return tiles_along_ * tiles_across_; }
    ImageTile tile(uint32_t number) const;

private:
    static constexpr uint32_t PACKET_SIDE = 4;
    static_assert(PACKET_SIDE * PACKET_SIDE == PACKET_WIDTH);

    RayLines(size_t count, size_t length, size_t lacking)
        : count_(count), length_(length), lacking_(lacking) {}

    size_t line_count() const { return (lacking_ + count_ + length_ - 1) / length_; }
    bool agree_with(const float *directions, float width);
    void set_tiles(double distance_across, double distance_along);

    size_t count_, length_;
    size_t lacking_; // in the first line
    // Four to the power of it is about how many times closer rays follow one another in a
    // line than lines do, as several samples a pixel. Squares and packets are the same then
    // in space, and wider than high in rays.
    uint32_t stretch_ = 0;
    uint32_t squares_ = 1; // of a tile
    size_t tile_width_ = 0, tile_height_ = 0;
    uint32_t tiles_along_ = 0, tiles_across_ = 0;
};

} // namespace mlrt
