// Declares what each file of bindings adds to the module.
#pragma once

#include <nanobind/nanobind.h>

namespace mlrt {

void bind_beam_leaf_selftest(nanobind::module_ &m);
void bind_image_plane(nanobind::module_ &m);
void bind_kdtree_selftest(nanobind::module_ &m);
void bind_mlrta_selftest(nanobind::module_ &m);
void bind_numerics(nanobind::module_ &m);
void bind_objects(nanobind::module_ &m);
void bind_render(nanobind::module_ &m);
void bind_render_selftest(nanobind::module_ &m);
void bind_wide_selftest(nanobind::module_ &m);
void bind_scene(nanobind::module_ &m);
void bind_tree(nanobind::module_ &m);
void bind_tree_files(nanobind::module_ &m);

} // namespace mlrt
