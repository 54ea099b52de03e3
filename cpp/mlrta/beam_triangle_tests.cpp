#include "mlrta/beam_triangle_tests.h"

#include "base/exactness.h"
#include "geometry/triangle_test.h"
#include "traverse/load_packet.h"
#include "traverse/parameter_interval.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace mlrt {

namespace {

// A beam that has been tested against more triangles than these meets a dense surface;
// chosen.
constexpr uint32_t DENSE_TRIANGLES = 64;

Vec3f direction_of(const RayGroup &rays, uint32_t i) {
    return {rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]};
}

} // namespace

// Where a beam meets many triangles, each leaf's are only fetched, to be tested when those
// of the next have been as well: the memory has time to bring them, and blocks are full.
template <Query query>
void BeamTriangleTests<query>::test_leaf(KdNode leaf) {
    for (const uint32_t primitive : tree_.references_of(leaf)) {
        if (mailbox_.put(primitive))
            continue;
        waiting_[waiting_count_++] = primitive;
        if (dense_) {
            prefetch(&tree_.triangles[primitive]);
            if (waiting_count_ == waiting_.size()) {
                test_block(waiting_.data(), BLOCK_WIDTH);
                waiting_count_ -= BLOCK_WIDTH;
                std::copy_n(waiting_.begin() + BLOCK_WIDTH, waiting_count_,
                            waiting_.begin());
            }
        } else if (waiting_count_ == BLOCK_WIDTH) {
            flush();
        }
    }
    if (!dense_)
        flush();
}

// Tests the triangles that wait.
template <Query query>
void BeamTriangleTests<query>::flush() {
    std::array<uint32_t, BLOCK_WIDTH> numbers;
    for (uint32_t first = 0; first < waiting_count_; first += BLOCK_WIDTH) {
        const uint32_t count = std::min(waiting_count_ - first, BLOCK_WIDTH);
        numbers.fill(waiting_[first]);
        std::copy_n(waiting_.begin() + first, count, numbers.begin());
        test_block(numbers.data(), count);
    }
    waiting_count_ = 0;
}

template <Query query>
void BeamTriangleTests<query>::test_block(const uint32_t *numbers, uint32_t count) {
    TriangleForms forms;
    forms.set(beam_, least_, tree_.triangles.data(), numbers, count);
    ++counters_.beam_blocks;
    const uint32_t tested = uint32_t(std::popcount(forms.possible | forms.unsafe));
    counters_.beam_triangles += tested;
    triangles_left_ -= std::min(triangles_left_, tested);
    tested_ += tested;
    if (tested_ > DENSE_TRIANGLES && !dense_) {
        grid_.fill(beam_);
        dense_ = true;
    }
    for_each_lane(forms.possible, [&](uint32_t lane) {
        if (dense_ && !grid_.may_hit(forms.box_p[lane], forms.box_q[lane],
                                     forms.box_half_p[lane], forms.box_half_q[lane]))
            return;
        test_triangle(forms, lane, numbers[lane]);
    });
    for_each_lane(forms.unsafe, [&](uint32_t lane) {
        for (uint32_t n = 0; n < beam_.count; ++n)
            test_unsafe(beam_.packets[n], numbers[lane]);
    });
}

// Packets that the triangle may touch, sixteen at a time, then their rays.
template <Query query>
void BeamTriangleTests<query>::test_triangle(const TriangleForms &forms, uint32_t lane,
                                             uint32_t primitive) {
    const auto beside = (absolute(beam_.center_p - forms.box_p[lane]) >
                         beam_.half_p + forms.box_half_p[lane]) |
                        (absolute(beam_.center_q - forms.box_q[lane]) >
                         beam_.half_q + forms.box_half_q[lane]);
    LaneBits packets = ((1u << beam_.count) - 1) & ~to_bits(beside);
    if (packets == 0)
        return;
    const FloatPacket edge_error(EXACT ? forms.edge_error[lane] : 0.0f);
    MaskOf<FloatPacket> touched, covered;
    FloatPacket smallest, greatest;
    for (int form = 0; form < 4; ++form) {
        const FloatPacket of_p(forms.of_p[form][lane]), of_q(forms.of_q[form][lane]);
        const FloatPacket middle =
            fused(of_p, beam_.center_p,
                  fused(of_q, beam_.center_q, FloatPacket(forms.center[form][lane])));
        const FloatPacket extent =
            fused(absolute(of_p), beam_.half_p, absolute(of_q) * beam_.half_q);
        if (form == TriangleForms::DEPTH) {
            greatest = middle + extent;
        } else if (form == 0) {
            smallest = middle - extent;
            greatest = middle + extent;
        } else {
            smallest = minimum(smallest, middle - extent);
            greatest = minimum(greatest, middle + extent);
        }
        if (form == 2) {
            touched = greatest >= -edge_error;
            covered = smallest > edge_error;
        }
    }
    const FloatPacket highest = EXACT ? fused(greatest, FloatPacket(forms.depth_grow[lane]),
                                              FloatPacket(forms.depth_error[lane]))
                                      : greatest;
    packets &= to_bits(touched & (highest >= load<FloatPacket>(beam_.least)));
    const LaneBits covered_packets = to_bits(covered);
    bool changed = false;
    for_each_lane(packets, [&](uint32_t n) {
        changed |= test_packet(beam_.packets[n], forms, lane, primitive,
                               (covered_packets >> n & 1) != 0);
    });
    if (changed)
        update_least();
}

// One triangle against sixteen rays. Returns whether they found something.
template <Query query>
bool BeamTriangleTests<query>::test_packet(BeamPacket &packet, const TriangleForms &forms,
                                           uint32_t lane, uint32_t primitive,
                                           bool covered) {
    ++counters_.triangle_tests;
    const auto value = [&](int form) {
        return fused(packet.u, FloatPacket(forms.of_u[form][lane]),
                     fused(packet.v, FloatPacket(forms.of_v[form][lane]),
                           FloatPacket(forms.constant[form][lane])));
    };
    const FloatPacket depth = value(TriangleForms::DEPTH);
    const FloatPacket error(forms.depth_error[lane]);
    const FloatPacket highest =
        EXACT ? fused(depth, FloatPacket(forms.depth_grow[lane]), error) : depth;
    LaneBits possible = to_bits(highest >= packet.least);
    LaneBits certain = possible;
    if (!covered) {
        const FloatPacket smallest = minimum(value(0), minimum(value(1), value(2)));
        const FloatPacket edge_error(EXACT ? forms.edge_error[lane] : 0.0f);
        possible &= to_bits(smallest >= -edge_error);
        if (possible == 0)
            return false;
        certain = EXACT ? possible & to_bits(smallest > edge_error) : possible;
    } else if (possible == 0) {
        return false;
    }
    const FloatPacket lowest =
        EXACT ? fused(depth, FloatPacket(forms.depth_shrink[lane]), -error) : depth;
    const LaneBits nearer =
        certain & to_bits((lowest > packet.greatest) & (highest < packet.nearest));
    if (nearer != 0) {
        const auto mask = from_bits<FloatPacket>(nearer);
        packet.found |= nearer;
        if constexpr (query == Query::any) {
            packet.least = select(mask, FloatPacket(INFINITE), packet.least);
        } else {
            packet.least = select(mask, lowest, packet.least);
            packet.greatest = select(mask, highest, packet.greatest);
            packet.primitive = select(from_bits<UIntPacket>(nearer), UIntPacket(primitive),
                                      packet.primitive);
        }
    }
    if (EXACT && (possible & ~nearer) != 0)
        decide(packet, possible & ~nearer, certain, primitive);
    beam_.least[size_t(&packet - beam_.packets.data())] = least_lane(packet.least);
    return true;
}

// By the contract of geometry/triangle_test.h, ray by ray.
template <Query query>
void BeamTriangleTests<query>::decide(BeamPacket &packet, LaneBits lanes,
                                      LaneBits certain_hits, uint32_t primitive) {
    const Triangle &triangle = tree_.triangles[primitive];
    LaneArray<float> least = to_lanes<float>(packet.least);
    LaneArray<float> greatest = to_lanes<float>(packet.greatest);
    LaneArray<uint32_t> best = to_lanes<uint32_t>(packet.primitive);
    for_each_lane(lanes, [&](uint32_t lane) {
        const uint32_t ray = packet.first_ray + lane;
        const Vec3f direction = direction_of(rays_, ray);
        ++counters_.double_tests;
        if ((certain_hits >> lane & 1) == 0) {
            const HitDecision decision = decide_hit(beam_.origin, direction, triangle);
            counters_.exact_tests += decision.precision == Precision::exact;
            if (!decision.hit)
                return;
        }
        const float t = hit_distance(beam_.origin, direction, triangle);
        if (!(t > std::max(rays_.t_min[ray], 0.0f) && t < INFINITE))
            return;
        if ((packet.found >> lane & 1) == 0) {
            if (!(t <= rays_.t_max[ray]))
                return;
        } else {
            const float other =
                hit_distance(beam_.origin, direction, tree_.triangles[best[lane]]);
            if (!(t < other || (t == other && primitive < best[lane])))
                return;
        }
        packet.found |= 1u << lane;
        best[lane] = primitive;
        // Of the distance, of the product, and of the reciprocal; and of a distance that
        // is denormal.
        const double main = std::abs(direction[beam_.axes[2]]);
        const double farthest = (double(t) + SMALLEST_FLOAT) * main;
        least[lane] = query == Query::any
                          ? INFINITE
                          : float(std::min((1 - 0x1p-21) / farthest, 0x1p126));
        greatest[lane] = float((1 + 0x1p-21) / (double(t) * main));
    });
    packet.least = load<FloatPacket>(least);
    packet.greatest = load<FloatPacket>(greatest);
    packet.primitive = load<UIntPacket>(best);
}

// A triangle of which the forms say nothing, such as one whose plane holds the origin.
template <Query query>
void BeamTriangleTests<query>::test_unsafe(BeamPacket &packet, uint32_t primitive) {
    const LaneBits searching = packet.active & to_bits(packet.least < INFINITE);
    ++counters_.triangle_tests;
    decide(packet, searching, 0, primitive);
    beam_.least[size_t(&packet - beam_.packets.data())] = least_lane(packet.least);
    update_least();
}

template <Query query>
void BeamTriangleTests<query>::update_least() {
    least_ = least_lane(load<FloatPacket>(beam_.least));
    far_end_ = (1 + 4 * FLOAT_ROUNDOFF) / least_;
}

template class BeamTriangleTests<Query::closest>;
template class BeamTriangleTests<Query::any>;

FloatPacket hit_distances(const KdTree &tree, const RayGroup &rays, int main_axis,
                          const BeamPacket &packet, Counters &counters) {
    // Fewer lanes of a triangle than this are faster one by one; chosen.
    constexpr int FEW = 3;
    if constexpr (!EXACT)
        return 1.0f /
               (packet.greatest * absolute(load_padded(rays.direction[main_axis],
                                                       packet.first_ray, rays.count)));
    Vec3<DoublePacket> direction;
    for (int k = 0; k < 3; ++k)
        direction[k] =
            to_double(load_padded(rays.direction[k], packet.first_ray, rays.count));
    const DoublePacket max_direction = maximum(
        absolute(direction.x), maximum(absolute(direction.y), absolute(direction.z)));
    const LaneArray<uint32_t> primitives = to_lanes<uint32_t>(packet.primitive);
    FloatPacket t(INFINITE);
    LaneBits one_by_one = 0;
    for (LaneBits left = packet.found; left != 0;) {
        const uint32_t primitive = primitives[uint32_t(std::countr_zero(left))];
        const LaneBits same = to_bits(packet.primitive == UIntPacket(primitive)) & left;
        left &= ~same;
        if (std::popcount(same) <= FEW) {
            one_by_one |= same;
            continue;
        }
        const Triangle &triangle = tree.triangles[primitive];
        const TrianglePlane plane(triangle);
        const Vec3d to_vertex = Vec3d(triangle.a) - Vec3d(rays.common_origin);
        const PlaneDistance<DoublePacket> distance(
            plane, PlaneNumerator<double>(plane, to_vertex), direction, max_direction);
        t = select(from_bits<FloatPacket>(same), distance.template rounded<FloatPacket>(),
                   t);
        const LaneBits open = same & ~to_bits(distance.template certain<FloatPacket>());
        counters.exact_distances += uint64_t(std::popcount(open));
        one_by_one |= open;
    }
    if (one_by_one == 0)
        return t;
    LaneArray<float> distances = to_lanes<float>(t);
    for_each_lane(one_by_one, [&](uint32_t lane) {
        distances[lane] =
            hit_distance(rays.common_origin, direction_of(rays, packet.first_ray + lane),
                         tree.triangles[primitives[lane]]);
    });
    return load<FloatPacket>(distances);
}

} // namespace mlrt
