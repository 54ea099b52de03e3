// BuildOptions and BuildReport as Python dicts.
#pragma once

#include "bind/fields.h"
#include "kdtree/builder.h"

namespace mlrt {

inline const EnumNames<Builder> BUILDERS{{"auto", Builder::automatic},
                                         {"exact", Builder::exact},
                                         {"fast", Builder::fast},
                                         {"lazy", Builder::lazy}};

inline const char *name_of(Builder builder) {
    for (const auto &[name, value] : BUILDERS)
        if (value == builder)
            return name;
    return "";
}

// Fields that are missing keep their default. Raises ValueError for an unknown one or a bad
// value.
inline BuildOptions build_options_from(nanobind::handle dict) {
    Fields fields(dict, "options");
    BuildOptions options;
    options.builder = fields.choice<Builder>("builder", BUILDERS, options.builder);
    options.traversal_cost = fields.number("traversal_cost", options.traversal_cost);
    options.intersection_cost =
        fields.number("intersection_cost", options.intersection_cost);
    options.empty_bonus = fields.number("empty_bonus", options.empty_bonus);
    options.clip = fields.boolean("clip", options.clip);
    options.rule_empty_cell = fields.boolean("rule_empty_cell", options.rule_empty_cell);
    options.rule_flat_cell = fields.boolean("rule_flat_cell", options.rule_flat_cell);
    options.rule_area_floor = fields.boolean("rule_area_floor", options.rule_area_floor);
    options.empty_cell_share = fields.number("empty_cell_share", options.empty_cell_share);
    options.area_floor = fields.number("area_floor", options.area_floor);
    options.max_depth = int(fields.integer_or("max_depth", 0, MAX_TREE_DEPTH));
    fields.finish();
    if (!(options.traversal_cost > 0 && options.intersection_cost > 0))
        refuse_value("traversal_cost and intersection_cost must be positive.");
    if (!(options.empty_bonus > 0 && options.empty_bonus <= 1))
        refuse_value("empty_bonus must be in (0, 1].");
    if (!(options.empty_cell_share > 0 && options.empty_cell_share <= 1))
        refuse_value("empty_cell_share must be in (0, 1].");
    if (!(options.area_floor >= 0 && options.area_floor <= 1))
        refuse_value(
            "area_floor must be in [0, 1]; 0 chooses it by the size of the triangles.");
    return options;
}

// All fields, those that were left at their default included.
inline nanobind::dict build_options_to_dict(const BuildOptions &options) {
    nanobind::dict dict;
    dict["builder"] = name_of(options.builder);
    dict["traversal_cost"] = options.traversal_cost;
    dict["intersection_cost"] = options.intersection_cost;
    dict["empty_bonus"] = options.empty_bonus;
    dict["clip"] = options.clip;
    dict["rule_empty_cell"] = options.rule_empty_cell;
    dict["rule_flat_cell"] = options.rule_flat_cell;
    dict["rule_area_floor"] = options.rule_area_floor;
    dict["empty_cell_share"] = options.empty_cell_share;
    dict["area_floor"] = options.area_floor;
    dict["max_depth"] = options.max_depth;
    return dict;
}

// Calls visit(name, value) for each field of a report.
template <typename Report, typename Visit>
void for_each_field(Report &report, Visit &&visit) {
    visit("inner_nodes", report.inner_nodes);
    visit("leaves", report.leaves);
    visit("empty_leaves", report.empty_leaves);
    visit("references", report.references);
    visit("max_leaf_count", report.max_leaf_count);
    visit("depth", report.depth);
    visit("empty_cell_splits", report.empty_cell_splits);
    visit("flat_cell_splits", report.flat_cell_splits);
    visit("area_floor_leaves", report.area_floor_leaves);
    visit("dropped_triangles", report.dropped_triangles);
    visit("sah_cost", report.sah_cost);
    visit("seconds", report.seconds);
    visit("seconds_bounds", report.seconds_bounds);
    visit("seconds_top", report.seconds_top);
    visit("seconds_subtrees", report.seconds_subtrees);
    visit("seconds_join", report.seconds_join);
}

inline nanobind::dict report_to_dict(const BuildReport &report) {
    nanobind::dict dict;
    dict["builder"] = name_of(report.builder);
    for_each_field(report, [&](const char *name, auto value) { dict[name] = value; });
    return dict;
}

// Raises ValueError unless each field is there and fits.
inline BuildReport report_from_dict(const nanobind::dict &dict) {
    BuildReport report;
    report.builder =
        Fields(dict, "its report").choice<Builder>("builder", BUILDERS, Builder::exact);
    for_each_field(report, [&](const char *name, auto &value) {
        if (!dict.contains(name) || !nanobind::try_cast(dict[name], value))
            refuse_value("its report has no valid '" + std::string(name) + "'");
    });
    return report;
}

} // namespace mlrt
