#include "render/bilinear_warp.h"

#include <algorithm>
#include <bit>

namespace mlrt {

namespace {

// Inverse of the distribution of a linear function with the values a at 0 and b at 1.
FloatPacket invert_linear(const FloatPacket &a, const FloatPacket &b,
                          const FloatPacket &random) {
    const FloatPacket squared = mix(a * a, b * b, random);
    const FloatPacket root = square_root(maximum(squared, FloatPacket(0.0f)));
    const auto uneven = absolute(a - b) > FloatPacket(1e-4f) * (a + b);
    return select(uneven, (a - root) / (a - b), random);
}

FloatPacket to_unit(const FloatPacket &a) {
    return minimum(maximum(a, FloatPacket(0.0f)), FloatPacket(1.0f));
}

// The next number in the lanes of the mask.
UIntPacket add_where(const MaskOf<FloatPacket> &mask, const UIntPacket &number) {
    return select(from_bits<UIntPacket>(to_bits(mask)), number + 1u, number);
}

} // namespace

BilinearWarp::Level::Level(uint32_t columns, uint32_t rows)
    : width(columns + columns % 2), sums(size_t(width) * (rows + rows % 2)) {}

BilinearWarp::BilinearWarp(uint32_t width, uint32_t height, std::span<const float> values)
    : width_(width) {
    uint32_t columns = width - 1, rows = height - 1;
    cells_ = {float(columns), float(rows)};
    cell_size_ = {1.0f / float(columns), 1.0f / float(rows)};

    const auto mean_of_cell = [&](uint32_t x, uint32_t y) {
        const float *corner = &values[size_t(y) * width + x];
        return 0.25f * (corner[0] + corner[1] + corner[width] + corner[width + 1]);
    };
    double sum = 0;
    for (uint32_t y = 0; y < rows; ++y)
        for (uint32_t x = 0; x < columns; ++x)
            sum += mean_of_cell(x, y);
    if (!(sum > 0))
        return;
    const float scale = float(double(uint64_t(columns) * rows) / sum);
    for (const float value : values)
        values_.push_back(value * scale);

    for (uint32_t side = std::bit_ceil(std::max(columns, rows)); side > 1; side /= 2) {
        Level level(columns, rows);
        for (uint32_t y = 0; y < rows; ++y)
            for (uint32_t x = 0; x < columns; ++x) {
                float &entry = level.sums[level.place(x, y)];
                if (levels_.empty()) {
                    entry = mean_of_cell(x, y) * scale;
                } else {
                    const Level &finer = levels_.back();
                    const float *quarters = &finer.sums[finer.place(2 * x, 2 * y)];
                    entry = quarters[0] + quarters[1] + quarters[2] + quarters[3];
                }
            }
        levels_.push_back(std::move(level));
        columns = (columns + 1) / 2;
        rows = (rows + 1) / 2;
    }
}

BilinearWarp::Samples BilinearWarp::sample(const FloatPacket &x,
                                           const FloatPacket &y) const {
    FloatPacket u = to_unit(x), v = to_unit(y);
    UIntPacket column(0u), row(0u);
    for (size_t i = levels_.size(); i-- > 0;) {
        const Level &level = levels_[i];
        column = column + column;
        row = row + row;
        const UIntPacket place = level.place(column, row);
        const float *sums = level.sums.data();
        const FloatPacket q00 = gather(sums, place), q10 = gather(sums + 1, place);
        const FloatPacket q01 = gather(sums + 2, place), q11 = gather(sums + 3, place);
        u = to_unit(u);
        v = to_unit(v);

        const FloatPacket upper = q00 + q10, lower = q01 + q11;
        v = v * (upper + lower);
        const auto down = v > upper;
        v = select(down, v - upper, v);
        const FloatPacket of_row = select(down, lower, upper);

        const FloatPacket left = select(down, q01, q00), right = select(down, q11, q10);
        u = u * of_row;
        const auto rightwards = u > left;
        u = select(rightwards, u - left, u);
        const FloatPacket of_column = select(rightwards, right, left);

        const FloatPacket inverse = FloatPacket(1.0f) / (of_row * of_column);
        v = v * (of_column * inverse);
        u = u * (of_row * inverse);
        column = add_where(rightwards, column);
        row = add_where(down, row);
    }

    const UIntPacket corner = column + row * UIntPacket(width_);
    const float *above = values_.data(), *below = above + width_;
    const FloatPacket v00 = gather(above, corner), v10 = gather(above + 1, corner);
    const FloatPacket v01 = gather(below, corner), v11 = gather(below + 1, corner);
    v = invert_linear(v00 + v10, v01 + v11, v);
    const FloatPacket left = mix(v00, v01, v), right = mix(v10, v11, v);
    u = invert_linear(left, right, u);
    return {{(FloatPacket(column) + u) * FloatPacket(cell_size_.x),
             (FloatPacket(row) + v) * FloatPacket(cell_size_.y)},
            mix(left, right, u)};
}

FloatPacket BilinearWarp::density(const Vec2<FloatPacket> &point) const {
    const FloatPacket one(1.0f);
    const FloatPacket x = to_unit(point.x) * FloatPacket(cells_.x);
    const FloatPacket y = to_unit(point.y) * FloatPacket(cells_.y);
    const FloatPacket column = minimum(floor(x), FloatPacket(cells_.x) - one);
    const FloatPacket row = minimum(floor(y), FloatPacket(cells_.y) - one);
    const UIntPacket corner = UIntPacket(column) + UIntPacket(row) * UIntPacket(width_);
    const float *above = values_.data(), *below = above + width_;
    const FloatPacket u = x - column;
    return mix(mix(gather(above, corner), gather(above + 1, corner), u),
               mix(gather(below, corner), gather(below + 1, corner), u), y - row);
}

} // namespace mlrt
