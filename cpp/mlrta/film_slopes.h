// What a part of a camera's film is in the slopes of a beam; for those see beam_packets.h.
#pragma once

#include "mlrta/beam.h"
#include "mlrta/range.h"

#include <array>

namespace mlrt {

// A linear combination of both slopes over a part of the film: its values, and bounds of
// how much they change along x and y, by pixel.
struct FilmCoordinate {
    Range range;
    double by_x = 0, by_y = 0;

    double middle() const { return 0.5 * (range.lo + range.hi); }
    // How far it is from its value in the middle of a part of that part.
    double reach(const FilmRectangle &part) const {
        return 0.5 * (by_x * part.width + by_y * part.height);
    }
};

// The slopes of directions (d_i, d_j, d_k) of which the components are linear in the film
// are extreme at its corners, as in camera_beam(), and so is P = c u + s v. Its derivative
// along x is (c d_i' + s d_j' - P d_k') / d_k with d' = dx: linear in P, and thus extreme
// at an end of its range, where d_k is least.
class FilmSlopes {
public:
    // Of the rectangle `film`. `axes` and `side` are those of BeamPackets.
    FilmSlopes(const CameraMap &camera, const FilmRectangle &film,
               const std::array<int, 3> &axes, float side);

    // Of d_k side, as computed.
    const Range &main() const { return main_; }

    // Slopes u (0) and v (1) of exact directions, and how far those of computed ones may be
    // from them once they are rounded. There is none where all are zero.
    struct Slope {
        Range range;
        double error;

        double size() const { return range.magnitude() + error; }
    };
    const Slope &slope(int n) const { return slopes_[size_t(n)]; }

    // The exact slopes at a place.
    Vec2<double> at(double x, double y) const;
    // In which direction slopes change along x, in the middle; of any length.
    Vec2<double> along_x() const;
    // Of c u + s v.
    FilmCoordinate coordinate(double c, double s) const;

private:
    // In the order (i, j, k), the last component times the side.
    struct Map {
        Vec3d base, dx, dy;
    };
    Vec3d direction(double x, double y) const {
        return map_.base + map_.dx * x + map_.dy * y;
    }
    Slope slope_of(int n, const Range &range, const Vec3d &delta) const;

    Map map_;
    std::array<Vec2<double>, 4> corners_;
    Range main_;
    std::array<Slope, 2> slopes_;
};

} // namespace mlrt
