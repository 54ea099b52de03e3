// Takes beams of a group with a common origin or a common direction from a frontier to
// their answers: by X4 as far as it pays, after regrouping rays that leave gaps, and by
// packets (X2) for the rest.
#pragma once

#include "base/exactness.h"
#include "mlrta/beam_leaf.h"
#include "mlrta/packet_tracer.h"
#include "mlrta/patience.h"

#include <bit>
#include <optional>

namespace mlrt {

// Origin tells which: CommonOrigin, or LaneOrigins for a common direction, of Query::any
// only.
template <typename Origin, typename Output>
class BeamTracer {
public:
    // Measured on office, conference, sponza and building: a beam visits each node once for
    // all of its rays, so that deeper searches cost more than they save.
    static constexpr uint32_t MINIMUM_TILE = 64, FRONTIER = 1;

    // `camera` has made the rays, if it is given.
    BeamTracer(const KdTree &tree, const RayGroup &rays, const TraceOptions &options,
               const CameraRays *camera, Output output, Counters &counters,
               BeamMemory &memory, uint32_t regroupings = 0)
        : tree_(tree), rays_(rays), options_(options), camera_(camera), output_(output),
          counters_(counters), memory_(memory),
          packets_(tree, rays, options, output, counters), beam_(memory.beam),
          regroupings_(regroupings), patience_(patience_of_thread<BeamTracer>(tree)),
          triangles_per_ray_(kept_by_thread<BeamTracer, TrianglesPerRay>(tree).mean) {}

    // Traces a run of rays.
    void trace(uint32_t first, uint32_t count, const Frontier &frontier) {
        for (uint32_t i = 0; i < count;) {
            const uint32_t left = count - i;
            if (may_be_huge(i, left)) {
                const uint32_t rays = std::min(left, HUGE_BEAM);
                if (trace_huge_beam(first + i, rays, frontier)) {
                    i += rays;
                    continue;
                }
            }
            const bool large = camera_ || (i % LARGE_BEAM == 0 &&
                                           triangles_per_ray_ <= LARGE_TRIANGLES_PER_RAY);
            const uint32_t rays = std::min(left, large ? LARGE_BEAM : SMALL_BEAM);
            if (packets_.knows_wide_tree() && patience_.spares_next()) {
                ++counters_.fallbacks;
                trace_apart(first + i, rays, frontier);
                i += rays;
                continue;
            }
            trace_beam(first + i, rays, frontier, camera_ != nullptr);
            i += rays;
        }
    }

private:
    struct TrianglesPerRay {
        float mean = 0;
    };

    static constexpr bool PARALLEL = std::is_same_v<Origin, LaneOrigins>;

    // A large beam shares the walk, and what is made of each triangle, by more rays: it
    // pays for a camera's rays, and for others that are as close to each other.
    static constexpr uint32_t HUGE_BEAM = BeamPackets::MAX_RAYS;
    static constexpr uint32_t LARGE_BEAM = Occupancy::MOST_RAYS;
    static constexpr uint32_t SMALL_BEAM = RayNumbers::CAPACITY;

    // Whether rays from number i on, of which so many are left, may be a beam that is
    // larger still. Aligned, so that beams of all sizes are squares of a camera's rays.
    bool may_be_huge(uint32_t i, uint32_t left) const {
        if (i % HUGE_BEAM != 0)
            return false;
        return camera_ ? left >= HUGE_BEAM
                       : Output::query == Query::any && left > LARGE_BEAM &&
                             triangles_per_ray_ <= HUGE_TRIANGLES_PER_RAY;
    }

    // Returns false if it was not tried, or given up, and has left nothing then.
    bool trace_huge_beam(uint32_t first, uint32_t count, const Frontier &frontier) {
        struct HugeBeams {};
        Patience &patience = patience_of_thread<HugeBeams>(tree_);
        if ((packets_.knows_wide_tree() && patience_.spares()) || patience.spares_next())
            return false;
        const uint64_t before = counters_.beam_triangles;
        if (!trace_beam(first, count, frontier, true)) {
            patience.lose();
            return false;
        }
        // Camera rays that meet nothing tell nothing of the next ones.
        const uint64_t spent = counters_.beam_triangles - before;
        if ((spent > 0 || Output::query == Query::any) && spent <= MOST_OF_HUGE_BEAM / 2)
            patience.win();
        return true;
    }

    // `ordered` tells that neighbours in the group are neighbours in space as well as
    // regrouping could make them. Returns false if a huge beam was given up.
    bool trace_beam(uint32_t first, uint32_t count, const Frontier &frontier,
                    bool ordered) {
        BeamPackets &beam = beam_;
        if constexpr (PARALLEL)
            beam.load_parallel(rays_, first, count, tree_.bounds);
        else if (!film_bounds_pay() || !beam.load_camera(rays_, first, count, *camera_))
            beam.load(rays_, first, count, camera_ ? &camera_->tile.camera : nullptr);
        if (!beam.any_active) {
            if (PARALLEL && beam.any_stray) // too little is certain of all of them
                packets_.trace(first, count, frontier);
            else
                trace_strays(frontier);
            return true;
        }
        const bool huge = count > LARGE_BEAM;
        if (huge && beam.any_stray)
            return false;
        if (count > SMALL_BEAM &&
            (beam.any_stray || (!camera_ && !huge && leaves_gaps()))) {
            for (uint32_t i = 0; i < count; i += SMALL_BEAM)
                trace_beam(first + i, std::min(count - i, SMALL_BEAM), frontier, ordered);
            return true;
        }
        if (regroupings_ < MOST_REGROUPINGS) {
            if (beam.any_stray) {
                set_strays_apart(frontier);
                return true;
            }
            if (!camera_ && count <= SMALL_BEAM && regroup(frontier, ordered))
                return true;
        }

        uint32_t active = 0;
        for (uint32_t n = 0; n < beam.count; ++n)
            active += uint32_t(std::popcount(beam.lanes[n].active));
        counters_.rays += active;
        counters_.packets += beam.count;
        ++counters_.beams;
        RayCost cost(rays_, counters_);
        const uint64_t before = counters_.beam_triangles;
        const BeamBudget budget = huge ? budget_of_huge_beam() : budget_of(active);
        const bool done = trace_beam_leaf<Output::query>(tree_, rays_, frontier, memory_,
                                                         budget, beam, counters_);
        if (const float share = cost.share(active); share > 0)
            for (uint32_t n = 0; n < beam.count; ++n)
                cost.add_to_lanes(beam.lanes[n].first_ray, beam.lanes[n].active, share);
        counters_.fallbacks += !done;
        if (!done && huge) {
            counters_.rays -= active;
            counters_.packets -= beam.count;
            return false;
        }
        const float spent = float(counters_.beam_triangles - before) / float(active);
        if (packets_.knows_wide_tree())
            judge(done, spent);
        else if (done && spent > DENSE)
            tree_.widening->miss(active); // rays that had better go apart
        triangles_per_ray_ += 0.5f * (spent - triangles_per_ray_);
        if constexpr (Output::query == Query::closest && EXACT_DISTANCES)
            if (done && output_.wants_distances())
                memory_.distances.prepare({memory_.hit.data(), memory_.hit_count});
        for (uint32_t n = 0; n < beam.count; ++n)
            finish(n, done, frontier);
        if (beam.any_stray)
            trace_strays(frontier);
        packets_.flush();
        return true;
    }

    // Whether beams pay, by the triangles that one spent on each of its rays.
    void judge(bool done, float spent) {
        if (!done || spent > DENSE)
            patience_.lose();
        else if (spent > 0 && spent < SPARSE)
            patience_.win();
    }

    // Traces a run of rays as packets, or one by one.
    void trace_apart(uint32_t first, uint32_t count, const Frontier &frontier) {
        for (uint32_t i = 0; i < count; i += PACKET_WIDTH)
            packets_.trace_stray(first + i, first_lanes(count - i), frontier);
        packets_.flush();
    }

    // Whether bounds by the film are narrow, or few triangles are tested against them.
    bool film_bounds_pay() const {
        return camera_ && (camera_->tile.begin == camera_->tile.end ||
                           triangles_per_ray_ <= LOOSE_TRIANGLES_PER_RAY);
    }

    // Writes what a packet has found, or leaves the rest of it to others.
    void finish(uint32_t number, bool done, const Frontier &frontier) {
        const PacketLanes &packet = beam_.lanes[number];
        LaneBits left = done ? 0 : packet.active;
        if constexpr (Output::query == Query::any) {
            output_.set(packet.first_ray, packet.found);
            left &= ~packet.found;
        } else if (done && beam_.covered.has(number)) {
            const UIntPacket primitive(beam_.covers[number].primitive);
            if (output_.wants_distances())
                output_.set(packet.first_ray, packet.active,
                            memory_.distances.of(rays_, packet.first_ray, packet.active,
                                                 primitive, counters_),
                            primitive);
            else
                output_.set(packet.first_ray, packet.active, primitive);
        } else if (done && packet.found != 0) {
            if (output_.wants_distances())
                output_.set(packet.first_ray, packet.found, distances_of(number),
                            beam_.packets[number].primitive);
            else
                output_.set(packet.first_ray, packet.found,
                            beam_.packets[number].primitive);
        }
        if (left == 0)
            return;
        // Those that trace them count them too.
        counters_.rays -= uint64_t(std::popcount(left));
        --counters_.packets;
        packets_.trace_stray(packet.first_ray, left, frontier);
    }

    FloatPacket distances_of(uint32_t number) {
        const PacketLanes &packet = beam_.lanes[number];
        if constexpr (EXACT_DISTANCES)
            return memory_.distances.of(rays_, packet.first_ray, packet.found,
                                        beam_.packets[number].primitive, counters_);
        // Reciprocal depths are all that single precision needs.
        const FloatPacket along_main_axis =
            load_padded(rays_.direction[beam_.axes[2]], packet.first_ray, rays_.count);
        return 1.0f / (beam_.packets[number].greatest * absolute(along_main_axis));
    }

    void trace_strays(const Frontier &frontier) {
        for (uint32_t n = 0; n < beam_.count; ++n)
            if (beam_.lanes[n].strays != 0)
                packets_.trace_lanes(beam_.lanes[n].first_ray, beam_.lanes[n].strays,
                                     frontier);
    }

    // Traces rays that go another way than the rest as a beam of their own.
    void set_strays_apart(const Frontier &frontier) {
        RayNumbers along, strays;
        for (uint32_t n = 0; n < beam_.count; ++n) {
            along.add(beam_.lanes[n].first_ray, beam_.lanes[n].active);
            strays.add(beam_.lanes[n].first_ray, beam_.lanes[n].strays);
        }
        trace_regrouped(along, frontier, false);
        trace_regrouped(strays, frontier, false);
    }

    // Whether the rays had better be regrouped.
    bool leaves_gaps() const {
        const Occupancy occupancy(beam_);
        return occupancy.best_cut(share_of_parts()) || occupancy.is_disordered(beam_);
    }

    float share_of_parts() const {
        return triangles_per_ray_ > COSTLY_TRIANGLES_PER_RAY ? COSTLY_SHARE : USUAL_SHARE;
    }

    // Traces the parts of a beam whose rays leave a gap as beams of their own, or all in a
    // better order. Returns false if neither helps.
    bool regroup(const Frontier &frontier, bool ordered) {
        if (beam_.count == 1)
            return false;
        const Occupancy occupancy(beam_);
        if (const auto cut = occupancy.best_cut(share_of_parts())) {
            RayNumbers before, beyond;
            occupancy.divide(beam_, *cut, before, beyond);
            trace_regrouped(before, frontier, ordered);
            trace_regrouped(beyond, frontier, ordered);
            return true;
        }
        if (ordered || !occupancy.is_disordered(beam_))
            return false;
        trace_regrouped(occupancy.sorted(beam_), frontier, true);
        return true;
    }

    void trace_regrouped(const RayNumbers &numbers, const Frontier &frontier,
                         bool ordered) {
        counters_.regrouped_rays += numbers.count;
        RegroupedRays part(rays_, numbers);
        typename Output::Buffer buffer;
        Output output = output_.into(buffer);
        output.clear(part.count);
        BeamTracer(tree_, part.group, options_, nullptr, output, counters_, memory_,
                   regroupings_ + 1)
            .trace_beam(0, part.count, frontier, ordered);
        output_.set(part, buffer);
        part.add_cost_to(rays_);
    }

    // Two parts of a beam are traced apart if the rectangles around them cover at most this
    // share of that of all: usually, and where beams meet so many triangles that smaller
    // ones pay. Measured on office, conference, sponza, building and dragon: shares from
    // 0.6 to 0.9, limits from 0.12 to 0.5 triangles a ray.
    static constexpr float USUAL_SHARE = 0.6f, COSTLY_SHARE = 0.75f;
    static constexpr float COSTLY_TRIANGLES_PER_RAY = 0.5f;

    // Rays that no camera has made are taken as large beams as long as the ones before met
    // no more triangles than this. Chosen from 0.05 to no limit, and beams of a camera from
    // that too, by the frames of office, conference, sponza and building.
    static constexpr float LARGE_TRIANGLES_PER_RAY = 0.2f;

    // Where beams met more triangles a ray, those of a camera are bounded by their rays,
    // and not by the film if that leaves open where in a pixel they lie. Chosen from 0.1
    // and no limit, by frames of conference.
    static constexpr float LOOSE_TRIANGLES_PER_RAY = 0.1f;

    // How often a ray is regrouped. Slopes that fall off as powers do are cut one ray at a
    // time, which would take a beam's rays squared, and as many frames of the stack as it
    // has rays. Halves take log2(SMALL_BEAM / PACKET_WIDTH) cuts; uneven ones a few more.
    static constexpr uint32_t MOST_REGROUPINGS = 16;

    // What a beam may test before it is given up for packets: rays that are far apart have
    // little in common. Dense scans take about four triangles a ray, where packets are
    // slower still. What a beam has found is lost then, unless any hit will do. Chosen from
    // 12 and no limit by the frames of conference and dragon.
    static constexpr uint32_t FREE_TRIANGLES = 64;
    static constexpr uint32_t MOST_TRIANGLES_PER_RAY =
        Output::query == Query::any ? 24 : 96;

    // What a huge beam may test before it is divided, at which triangle it is first looked
    // at what it finds, and how many rays a triangle should have found something then:
    // where triangles are small, the nearer ones of them leave more to be tested than
    // smaller beams would. Chosen from 40 to 500, from 30 to 80 and from 20 to 60 or none,
    // by what tracing takes in office, conference, sponza and building.
    static constexpr uint32_t FIRST_LOOK_AT_HUGE_BEAM = 60;
    static constexpr float LEAST_YIELD_OF_HUGE_BEAM = 30;
    // Shadow rays are not looked at how they lie to each other in such a beam, so that it
    // had better meet few triangles, as the beams before it did. Chosen from 0.01 to 0.2
    // and from 40 to 300 by shadow rays of office, conference, building and sponza.
    static constexpr uint32_t MOST_OF_HUGE_BEAM = Output::query == Query::any ? 120 : 160;
    static constexpr float HUGE_TRIANGLES_PER_RAY = 0.03f;

    // The same where there is the wide tree, which takes less time then. Chosen from 2 to
    // 12 by the frames of conference, sponza, building and dragon. It is not looked at what
    // shadow rays find (see FIRST_LOOK), so that their beams are given up sooner: chosen
    // from 0.7 to 4 by those of conference, of which it saves 2 to 5 %.
    static constexpr float MOST_BESIDE_WIDE_TREE =
        Output::query == Query::any ? 1.2f : 4.0f;

    // Beams that meet more triangles a ray than the first had better not be tried, those
    // that meet less than the second had. Chosen from 2 to 4 and from 0.5 to 2 by the same.
    static constexpr float DENSE = 3, SPARSE = 1;

    // Triangles a ray at which it is first looked at what a beam finds, and how many rays a
    // triangle should have found something, where there is the wide tree: dense scans are
    // given up early then. Chosen from 0.1 and 0.19, and from 0 to 0.5, by the frames of
    // conference and dragon. Of shadow rays, most of which find nothing, it tells little.
    static constexpr float FIRST_LOOK = 0.19f;
    static constexpr uint32_t FREE_OF_LOOKS = 32;
    static constexpr float LEAST_YIELD = 0.3f;

    static BeamBudget budget_of_huge_beam() {
        if constexpr (Output::query == Query::any)
            return BeamBudget(MOST_OF_HUGE_BEAM);
        return BeamBudget(MOST_OF_HUGE_BEAM, FIRST_LOOK_AT_HUGE_BEAM,
                          LEAST_YIELD_OF_HUGE_BEAM);
    }

    BeamBudget budget_of(uint32_t rays) const {
        if (options_.traversal != Traversal::adaptive)
            return BeamBudget::without_end();
        if (!packets_.knows_wide_tree())
            return BeamBudget(FREE_TRIANGLES + MOST_TRIANGLES_PER_RAY * rays);
        const uint32_t most =
            FREE_TRIANGLES + uint32_t(MOST_BESIDE_WIDE_TREE * float(rays));
        if constexpr (Output::query == Query::any)
            return BeamBudget(most);
        const uint32_t first_look = FREE_OF_LOOKS + uint32_t(FIRST_LOOK * float(rays));
        return BeamBudget(most, first_look, LEAST_YIELD);
    }

    const KdTree &tree_;
    const RayGroup &rays_;
    const TraceOptions &options_;
    const CameraRays *camera_;
    Output output_;
    Counters &counters_;
    BeamMemory &memory_;
    PacketTracer<Origin, Output> packets_;
    BeamPackets &beam_;    // kept by the memory, since regrouped rays need it no more
    uint32_t regroupings_; // that these rays come from
    Patience &patience_;
    // Tested against beams that this thread traced last: a moving average.
    float &triangles_per_ray_;
};

} // namespace mlrt
