// The Python module of one instruction set: one function per file of bindings.
#include "bind/bind.h"

NB_MODULE(MLRT_MODULE, m) {
    m.attr("isa") = MLRT_ISA_NAME;
    mlrt::bind_beam_leaf_selftest(m);
    mlrt::bind_kdtree_selftest(m);
    mlrt::bind_mlrta_selftest(m);
    mlrt::bind_numerics(m);
    mlrt::bind_tree(m);
    mlrt::bind_tree_files(m);
    mlrt::bind_objects(m);
    mlrt::bind_scene(m);
    mlrt::bind_image_plane(m);
    mlrt::bind_render(m);
    mlrt::bind_render_selftest(m);
    mlrt::bind_wide_selftest(m);
}
