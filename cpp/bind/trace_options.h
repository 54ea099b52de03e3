// TraceOptions and Counters as Python dicts.
#pragma once

#include "base/counters.h"
#include "bind/fields.h"
#include "mlrta/frontier.h"
#include "mlrta/trace.h"

namespace mlrt {

// Fields that are missing keep their default. Raises ValueError for an unknown one or a bad
// value.
inline TraceOptions trace_options_from(nanobind::handle dict) {
    Fields fields(dict, "options");
    TraceOptions options;
    options.traversal = fields.choice<Traversal>("traversal",
                                                 {{"brute_force", Traversal::brute_force},
                                                  {"single", Traversal::single},
                                                  {"packet", Traversal::packet},
                                                  {"interval", Traversal::interval},
                                                  {"beam_leaf", Traversal::beam_leaf},
                                                  {"wide", Traversal::wide},
                                                  {"adaptive", Traversal::adaptive}},
                                                 options.traversal);
    options.entry_points = fields.boolean("entry_points", options.entry_points);
    options.initial_tile = fields.integer_or("initial_tile", options.initial_tile, 1024);
    options.minimum_tile = fields.integer_or("minimum_tile", options.minimum_tile, 1024);
    options.split_factor = fields.integer_or("split_factor", options.split_factor, 16);
    options.leaf_rejection =
        fields.choice<LeafRejection>("leaf_rejection",
                                     {{"none", LeafRejection::none},
                                      {"parameters", LeafRejection::parameters},
                                      {"slopes", LeafRejection::slopes}},
                                     options.leaf_rejection);
    options.culling = fields.choice<Culling>("culling",
                                             {{"none", Culling::none},
                                              {"inverse_frustum", Culling::inverse_frustum},
                                              {"frustum_planes", Culling::frustum_planes}},
                                             options.culling);
    options.search_order = fields.choice<SearchOrder>(
        "search_order",
        {{"paper", SearchOrder::paper}, {"shallow_first", SearchOrder::shallow_first}},
        options.search_order);
    options.frontier = fields.integer_or("frontier", options.frontier, MAX_FRONTIER);
    options.covering_triangles =
        fields.boolean("covering_triangles", options.covering_triangles);
    const bool names_minimum = fields.has("minimum_tile");
    const bool names_frontier = fields.has("frontier");
    fields.finish();
    if (options.initial_tile == 0 || (names_minimum && options.minimum_tile == 0))
        refuse_value(
            "options['initial_tile'] and options['minimum_tile'] must be positive.");
    if (options.minimum_tile > options.initial_tile)
        refuse_value("options['minimum_tile'] must not exceed options['initial_tile'].");
    if (names_frontier && options.frontier == 0)
        refuse_value("options['frontier'] must be positive.");
    if (options.split_factor != 4 && options.split_factor != 16)
        refuse_value("options['split_factor'] must be 4 or 16.");
    return options;
}

// Keys are the names of the fields after a prefix.
inline nanobind::dict counters_to_dict(const Counters &counters,
                                       const std::string &prefix = "") {
    nanobind::dict dict;
    const auto add = [&](const char *name, uint64_t value) {
        dict[(prefix + name).c_str()] = value;
    };
    add("rays", counters.rays);
    add("packets", counters.packets);
    add("entry_steps", counters.entry_steps);
    add("traversal_steps", counters.traversal_steps);
    add("leaf_visits", counters.leaf_visits);
    add("frontier_tests", counters.frontier_tests);
    add("triangle_tests", counters.triangle_tests);
    add("beams", counters.beams);
    add("beam_steps", counters.beam_steps);
    add("beam_blocks", counters.beam_blocks);
    add("beam_triangles", counters.beam_triangles);
    add("double_tests", counters.double_tests);
    add("exact_tests", counters.exact_tests);
    add("exact_distances", counters.exact_distances);
    add("tiles", counters.tiles);
    add("missed_tiles", counters.missed_tiles);
    add("splits", counters.splits);
    add("fallbacks", counters.fallbacks);
    add("blockers", counters.blockers);
    add("regrouped_rays", counters.regrouped_rays);
    return dict;
}

} // namespace mlrt
