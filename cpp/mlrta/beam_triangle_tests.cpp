#include "mlrta/beam_triangle_tests.h"

#include "base/exactness.h"
#include "geometry/coplanar.h"
#include "geometry/triangle_test.h"
#include "mlrta/block_pairs.h"
#include "traverse/load_packet.h"
#include "traverse/parameter_interval.h"
#include "traverse/single.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace mlrt {

namespace {

// A beam that has been tested against more triangles than these meets a dense surface;
// chosen from 40 to 300.
constexpr uint32_t DENSE_TRIANGLES = 200;

// So many blocks are tested leaf by leaf, full or not; chosen from 1 to 4.
constexpr uint32_t BLOCKS_AT_ONCE = 4;

Vec3f direction_of(const RayGroup &rays, uint32_t i) {
    return {rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]};
}

} // namespace

template <Query query>
void BeamTriangleTests<query>::test_first(std::span<const uint32_t> primitives) {
    for (const uint32_t primitive : primitives)
        mailbox_.put(primitive);
    std::copy(primitives.begin(), primitives.end(), waiting_.begin());
    waiting_count_ = uint32_t(primitives.size());
    flush();
}

// The first leaves' triangles are tested at once, as they may stop all rays. Those of a
// beam that goes on wait till a block is full, and where it meets many, until those of the
// next leaves have been fetched as well: the memory has time to bring them.
template <Query query>
void BeamTriangleTests<query>::test_leaf(KdNode leaf) {
    const bool fills = blocks_ >= BLOCKS_AT_ONCE;
    for (const uint32_t primitive : tree_.references_of(leaf)) {
        // Without a branch, as nobody foresees which are known.
        waiting_[waiting_count_] = primitive;
        waiting_count_ += !mailbox_.put(primitive);
        if (fills)
            prefetch(&tree_.triangles[primitive]);
        if (waiting_count_ < (dense_ ? waiting_.size() : WIDE_WIDTH))
            continue;
        test_block(waiting_.data(), WIDE_WIDTH);
        waiting_count_ -= WIDE_WIDTH;
        std::copy_n(waiting_.begin() + WIDE_WIDTH, waiting_count_, waiting_.begin());
    }
    if (!fills)
        flush();
}

// Tests the triangles that wait.
template <Query query>
void BeamTriangleTests<query>::flush() {
    std::array<uint32_t, WIDE_WIDTH> numbers;
    for (uint32_t first = 0; first < waiting_count_; first += WIDE_WIDTH) {
        const uint32_t count = std::min(waiting_count_ - first, WIDE_WIDTH);
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
    ++blocks_;
    ++counters_.beam_blocks;
    const uint32_t tested = uint32_t(std::popcount(forms.possible | forms.unsafe));
    counters_.beam_triangles += tested;
    budget_.spend(tested, [&] { return beam_.found_count(); });
    if (query == Query::closest && spent())
        return; // nobody will look at what is found
    if (budget_.tested() > DENSE_TRIANGLES && !dense_) {
        beam_.load_slopes(rays_);
        grid_.fill(beam_);
        dense_ = true;
    }
    const LaneBits possible =
        dense_ ? grid_.may_hit(forms, forms.possible) : forms.possible;
    const bool one_run = beam_.run_count() == 1;
    const LaneBits large = query == Query::closest ? forms.possible_covers(beam_) : 0;
    RunPairs of_large, of_small;
    for (uint32_t n = 0; n < beam_.run_count(); ++n) {
        const LaneBits triangles =
            one_run ? possible : possible & forms.possible_for(beam_.runs[n]);
        if constexpr (query == Query::closest)
            of_large.add(n, triangles & large);
        of_small.add(n, triangles & ~large);
    }
    LaneBits hit = 0;
    uint32_t pairs = 0;
    BeamPackets::Packets in_pairs;
    const auto add_pairs = [&](uint32_t first, LaneBits packets) {
        in_pairs.run(run_of_pair(first)) |= packets;
        store_compressed(pairs_.data() + pairs, lane_indices() + UIntPacket(first),
                         packets);
        pairs += uint32_t(std::popcount(packets));
    };
    bool any_covered = false;
    for (const uint32_t first : of_large.all()) {
        const uint32_t n = run_of_pair(first), lane = lane_of_pair(first);
        const auto coverage = forms.coverage_of(lane, beam_, beam_.runs[n]);
        const LaneBits packets = coverage.possible & ~coverage.covered;
        if (coverage.covered != 0) {
            cover(n, coverage, forms, lane, numbers[lane]);
            any_covered = true;
            hit |= LaneBits(1) << lane;
        }
        add_pairs(first, packets);
    }
    for (const uint32_t first : of_small.all()) {
        const BeamPackets::Run &run = beam_.runs[run_of_pair(first)];
        add_pairs(first, forms.packets_for(lane_of_pair(first), run));
    }
    counters_.triangle_tests += pairs;
    if constexpr (query == Query::closest)
        for (uint32_t n = 0; n < beam_.run_count(); ++n)
            beam_.settle(rays_, n, in_pairs.run(n));
    BeamPackets::Packets changed;
    bool any_changed = false;
    for (uint32_t i = 0; i < pairs; ++i) {
        const uint32_t n = packet_of_pair(pairs_[i]), lane = lane_of_pair(pairs_[i]);
        const LaneBits found = test_packet(n, forms, lane, numbers[lane]);
        changed.run(n / PACKET_WIDTH) |= found << n % PACKET_WIDTH;
        hit |= found << lane;
        any_changed |= found != 0;
    }
    for_each_lane(hit, [&](uint32_t lane) {
        if (hit_count_ < hit_.size())
            hit_[hit_count_++] = numbers[lane];
    });
    if (any_changed)
        update_least(changed);
    else if (any_covered)
        update_least();
    for_each_lane(forms.unsafe, [&](uint32_t lane) { test_unsafe(numbers[lane]); });
}

// Packets of a run, of which a triangle covers some.
template <Query query>
void BeamTriangleTests<query>::cover(uint32_t number,
                                     const TriangleForms::Coverage &coverage,
                                     const TriangleForms &forms, uint32_t lane,
                                     uint32_t primitive) {
    BeamPackets::Run &run = beam_.runs[number];
    const auto mask = from_bits<FloatPacket>(coverage.covered);
    const auto raise = [&](LaneArray<float> &bounds, const FloatPacket &to) {
        store(bounds.data(), select(mask, to, load<FloatPacket>(bounds)));
    };
    raise(run.least, coverage.least);
    raise(run.greatest, coverage.greatest);
    run.all.least = least_lane(load<FloatPacket>(run.least));
    const uint32_t first = number * PACKET_WIDTH;
    beam_.covered.run(number) |= coverage.covered;
    constexpr int DEPTH = TriangleForms::DEPTH;
    const BeamPackets::Cover cover{primitive,
                                   forms.constant[DEPTH][lane],
                                   forms.of_u[DEPTH][lane],
                                   forms.of_v[DEPTH][lane],
                                   EXACT_DISTANCES ? forms.depth_shrink[lane] : 1.0f,
                                   EXACT_DISTANCES ? forms.depth_grow[lane] : 1.0f,
                                   EXACT_DISTANCES ? forms.depth_error[lane] : 0.0f};
    for_each_lane(coverage.covered, [&](uint32_t i) { beam_.covers[first + i] = cover; });
}

// A triangle as sixteen rays see it.
template <Query query>
auto BeamTriangleTests<query>::see(uint32_t number, const TriangleForms &forms,
                                   uint32_t lane) const -> Seen {
    const BeamPacket &packet = beam_.packets[number];
    const auto value = [&](int form) {
        return fused(packet.u, FloatPacket(forms.of_u[form][lane]),
                     fused(packet.v, FloatPacket(forms.of_v[form][lane]),
                           FloatPacket(forms.constant[form][lane])));
    };
    const FloatPacket depth = value(TriangleForms::DEPTH);
    const FloatPacket error(forms.depth_error[lane]);
    const FloatPacket edge_error(EXACT ? forms.ray_error[lane] : 0.0f);
    Seen seen;
    seen.highest =
        EXACT_DISTANCES ? fused(depth, FloatPacket(forms.depth_grow[lane]), error) : depth;
    seen.lowest = EXACT_DISTANCES
                      ? fused(depth, FloatPacket(forms.depth_shrink[lane]), -error)
                      : depth;
    const FloatPacket smallest = minimum(value(0), minimum(value(1), value(2)));
    seen.possible = (seen.highest >= packet.least) & (smallest >= -edge_error);
    FloatPacket begin(beam_.nearest);
    if (query == Query::any && beam_.parallel) {
        begin = beam_.begins[number].least;
        seen.possible &= seen.lowest <= beam_.begins[number].greatest;
    }
    seen.certain = EXACT ? smallest > edge_error : smallest >= edge_error;
    seen.nearer = (seen.lowest > packet.greatest) & (seen.highest < begin);
    return seen;
}

// One triangle against sixteen rays. Returns whether they found something. Without a frame
// of the stack, since what is seldom needed is called at the end.
template <Query query>
bool BeamTriangleTests<query>::test_packet(uint32_t number, const TriangleForms &forms,
                                           uint32_t lane, uint32_t primitive) {
    const Seen seen = see(number, forms, lane);
    const auto hit = seen.possible & seen.certain & seen.nearer;
    const LaneBits found = to_bits(hit);
    take(number, hit, found, seen.lowest, seen.highest, primitive);
    const LaneBits open = EXACT ? to_bits(seen.possible) & ~found : 0;
    if (open != 0) [[unlikely]]
        return decide_open(number, forms, lane, primitive, open);
    return found != 0;
}

// Rays of which test_packet() leaves it open whether they find something.
template <Query query>
[[gnu::noinline]] bool
BeamTriangleTests<query>::decide_open(uint32_t number, const TriangleForms &forms,
                                      uint32_t lane, uint32_t primitive, LaneBits open) {
    decide(number, open, see(number, forms, lane), primitive);
    return true;
}

// Hits of a triangle at depths that have these bounds; `mask` has the same lanes.
template <Query query>
void BeamTriangleTests<query>::take(uint32_t number, const MaskOf<FloatPacket> &mask,
                                    LaneBits lanes, const FloatPacket &lowest,
                                    const FloatPacket &highest, uint32_t primitive) {
    BeamPacket &packet = beam_.packets[number];
    beam_.lanes[number].found |= lanes;
    if constexpr (query == Query::any) {
        packet.least = select(mask, FloatPacket(INFINITE), packet.least);
    } else {
        packet.least = select(mask, lowest, packet.least);
        packet.greatest = select(mask, highest, packet.greatest);
        packet.primitive =
            select(MaskOf<UIntPacket>(mask), UIntPacket(primitive), packet.primitive);
    }
}

// By the contract of geometry/triangle_test.h. Where a depth certainly is the nearest, only
// whether the ray hits is decided.
template <Query query>
void BeamTriangleTests<query>::decide(uint32_t number, LaneBits lanes, const Seen &seen,
                                      uint32_t primitive) {
    const LaneBits certain_hits = to_bits(seen.certain), nearest = to_bits(seen.nearer);
    if (query == Query::any && beam_.parallel) {
        decide_parallel(number, lanes, certain_hits, primitive);
        return;
    }
    BeamPacket &packet = beam_.packets[number];
    const PacketLanes &of_rays = beam_.lanes[number];
    // In one plane a ray has one distance, and the lower number wins.
    LaneBits tied = 0;
    for_each_value(packet.primitive, lanes & of_rays.found & ~nearest,
                   [&](uint32_t rival, LaneBits holders) {
                       if (rival != primitive && !in_one_plane(tree_.triangles[rival],
                                                               tree_.triangles[primitive]))
                           return;
                       if (primitive < rival)
                           tied |= holders;
                       else
                           lanes &= ~holders;
                   });
    counters_.double_tests += uint64_t(std::popcount(lanes));
    LaneBits hits = lanes & certain_hits;
    for_each_lane(lanes & ~certain_hits, [&](uint32_t lane) {
        const HitDecision decision =
            decide_hit(beam_.origin, direction_of(rays_, of_rays.first_ray + lane),
                       tree_.triangles[primitive]);
        counters_.exact_tests += decision.precision == Precision::exact;
        hits |= LaneBits(decision.hit) << lane;
    });
    take(number, hits & nearest, seen.lowest, seen.highest, primitive);
    hits &= ~nearest;
    const UIntPacket challenger(primitive);
    tied &= hits;
    packet.primitive = select(from_bits<UIntPacket>(tied), challenger, packet.primitive);
    hits &= ~tied;
    if (hits == 0)
        return;

    const auto distances = [&](LaneBits of, const UIntPacket &primitives) {
        return distances_.of(rays_, of_rays.first_ray, of, primitives, counters_);
    };
    const FloatPacket t = distances(hits, challenger);
    const FloatPacket t_min = load_padded(rays_.t_min, of_rays.first_ray, rays_.count);
    const FloatPacket t_max = load_padded(rays_.t_max, of_rays.first_ray, rays_.count);
    hits &= to_bits((t > maximum(t_min, FloatPacket(0.0f))) & (t < INFINITE));
    if (const LaneBits rivals = hits & of_rays.found; rivals != 0) {
        const FloatPacket other = distances(rivals, packet.primitive);
        const LaneBits nearer =
            to_bits(t < other) |
            (to_bits(t == other) & to_bits(challenger < packet.primitive));
        hits &= nearer | ~rivals;
    }
    hits &= to_bits(t <= t_max) | of_rays.found;
    if (hits == 0)
        return;

    if constexpr (query == Query::any) {
        take(number, hits, FloatPacket(INFINITE), FloatPacket(INFINITE), primitive);
        return;
    }
    // Of the distance, of the product, and of the reciprocal; and of a distance that is
    // denormal.
    const DoublePacket main = absolute(to_double(
        load_padded(rays_.direction[beam_.axes[2]], of_rays.first_ray, rays_.count)));
    const DoublePacket distance = to_double(t);
    const DoublePacket farthest = (distance + double(SMALLEST_FLOAT)) * main;
    take(number, hits,
         minimum(FloatPacket((1 - 0x1p-21) / farthest), FloatPacket(0x1p126f)),
         FloatPacket((1 + 0x1p-21) / (distance * main)), primitive);
}

// The same for rays that each have an origin, of Query::any.
template <Query query>
void BeamTriangleTests<query>::decide_parallel(uint32_t number, LaneBits lanes,
                                               LaneBits certain_hits, uint32_t primitive) {
    counters_.double_tests += uint64_t(std::popcount(lanes));
    const Triangle &triangle = tree_.triangles[primitive];
    BeamPacket &packet = beam_.packets[number];
    PacketLanes &of_rays = beam_.lanes[number];
    LaneBits hits = 0;
    for_each_lane(lanes, [&](uint32_t lane) {
        const Ray ray = ray_of(rays_, of_rays.first_ray + lane);
        if ((certain_hits >> lane & 1) == 0) {
            const HitDecision decision = decide_hit(ray.origin, ray.direction, triangle);
            counters_.exact_tests += decision.precision == Precision::exact;
            if (!decision.hit)
                return;
        }
        const float t = hit_distance(ray.origin, ray.direction, triangle, counters_);
        hits |= LaneBits(t > std::max(ray.t_min, 0.0f) && t <= ray.t_max && t < INFINITE)
                << lane;
    });
    of_rays.found |= hits;
    packet.least =
        select(from_bits<FloatPacket>(hits), FloatPacket(INFINITE), packet.least);
}

// A triangle of which the forms say nothing, such as one whose plane holds the origin.
template <Query query>
void BeamTriangleTests<query>::test_unsafe(uint32_t primitive) {
    for (uint32_t n = 0; n < beam_.run_count(); ++n)
        beam_.settle(rays_, n, ALL_LANES);
    for (uint32_t n = 0; n < beam_.count; ++n) {
        const LaneBits searching = to_bits(beam_.packets[n].least < INFINITE);
        decide(n, beam_.lanes[n].active & searching, {}, primitive);
    }
    counters_.triangle_tests += beam_.count;
    update_least(BeamPackets::Packets::of_first(beam_.count));
}

// After some packets have found something.
template <Query query>
void BeamTriangleTests<query>::update_least(const BeamPackets::Packets &packets) {
    for (uint32_t n = 0; n < beam_.run_count(); ++n) {
        const LaneBits changed = packets.run(n);
        if (changed == 0)
            continue;
        BeamPackets::Run &run = beam_.runs[n];
        // In a register: lanes that were written one by one are read late.
        FloatPacket least = load<FloatPacket>(run.least);
        for_each_lane(changed, [&](uint32_t i) {
            const float of_packet = least_lane(beam_.packets[n * PACKET_WIDTH + i].least);
            least = select(from_bits<FloatPacket>(1u << i), FloatPacket(of_packet), least);
        });
        store(run.least.data(), least);
        store(run.greatest.data(),
              select(from_bits<FloatPacket>(changed), FloatPacket(INFINITE),
                     load<FloatPacket>(run.greatest)));
        run.all.least = least_lane(least);
    }
    update_least();
}

template <Query query>
void BeamTriangleTests<query>::update_least() {
    least_ = INFINITY;
    for (uint32_t n = 0; n < beam_.run_count(); ++n)
        least_ = std::min(least_, beam_.runs[n].all.least);
    far_end_ = beam_.parallel ? -least_ : (1 + 4 * FLOAT_ROUNDOFF) / least_;
}

template class BeamTriangleTests<Query::closest>;
template class BeamTriangleTests<Query::any>;

} // namespace mlrt
