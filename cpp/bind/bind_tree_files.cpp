// What a tree consists of, for those who store, load and measure trees.
#include "bind/arrays.h"
#include "bind/bind.h"
#include "bind/build_options.h"
#include "bind/mesh_arrays.h"
#include "bind/tree_handle.h"
#include "bind/watch.h"
#include "geometry/degenerate.h"
#include "kdtree/lazy.h"
#include "kdtree/report.h"
#include "kdtree/serialize.h"

#include <cstring>
#include <memory>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <type_traits>
#include <vector>

namespace nb = nanobind;

namespace mlrt {

namespace {

using Bytes = nb::ndarray<const uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// Elements as an array (N, words) that borrows them and keeps their owner alive.
template <typename Word, typename T>
nb::object words_of(const T *elements, uint64_t count, nb::handle owner) {
    constexpr size_t WORDS = sizeof(T) / sizeof(Word);
    const auto *data = reinterpret_cast<const Word *>(elements);
    return nb::ndarray<nb::numpy, const Word>(data, {count, WORDS}, owner).cast();
}

struct Sizes {
    uint64_t nodes, references;
};

// A lazy tree grows in the capacity of its arrays.
Sizes sizes_of(const KdTree &tree) {
    if (!tree.growth)
        return {tree.nodes.size(), tree.references.size()};
    const GrowthState state = tree.growth->state();
    return {state.nodes, state.references};
}

bool is_finished(const KdTree &tree) {
    return !tree.growth || tree.growth->state().unbuilt_cells == 0;
}

// A tree that comes in pieces: first its triangles, then the bytes of its nodes and
// references.
class TreeLoader {
public:
    TreeLoader(const Points &vertices, const Faces &faces) {
        stored_->triangles = triangles_of(vertices, faces);
    }

    const KdTree &stored() const { return *stored_; }

    void reserve(size_t node_count, size_t reference_count) {
        if (stored_.use_count() > 1)
            throw std::logic_error("the tree is finished");
        if (node_count > KdNode::MAX_NODES || reference_count > 0xffffffffu)
            refuse_value("it has more nodes or references than a tree can have");
        stored_->nodes = decltype(stored_->nodes)(node_count);
        stored_->references = decltype(stored_->references)(reference_count);
        loaded_ = 0;
    }

    // Takes bytes that follow those before: all of the nodes, then all of the references.
    void append(const Bytes &bytes) {
        if (stored_.use_count() > 1)
            throw std::logic_error("the tree is finished");
        if (bytes.size() > node_bytes() + reference_bytes() - loaded_)
            throw std::out_of_range("more bytes than the nodes and references have");
        const nb::gil_scoped_release release;
        size_t taken = 0;
        if (loaded_ < node_bytes()) {
            taken = std::min(bytes.size(), node_bytes() - loaded_);
            copy(stored_->nodes.data(), loaded_, bytes.data(), taken);
        }
        copy(stored_->references.data(), loaded_ + taken - node_bytes(),
             bytes.data() + taken, bytes.size() - taken);
        loaded_ += bytes.size();
    }

    TreeHandle finish(const nb::dict &report, const nb::kwargs &options) {
        if (loaded_ != node_bytes() + reference_bytes())
            refuse_value("it lacks nodes or references");
        TreeHandle handle{nullptr, report_from_dict(report), build_options_from(options)};
        const nb::gil_scoped_release release;
        restore(*stored_);
        handle.tree = stored_;
        return handle;
    }

private:
    static_assert(std::is_trivially_copyable_v<KdNode>);

    size_t node_bytes() const { return stored_->nodes.size() * sizeof(KdNode); }
    size_t reference_bytes() const { return stored_->references.size() * sizeof(uint32_t); }

    static void copy(void *list, size_t offset, const uint8_t *bytes, size_t count) {
        if (count > 0)
            std::memcpy(static_cast<char *>(list) + offset, bytes, count);
    }

    // Shared with the handle that is made of it: arrays may borrow from the loader still.
    std::shared_ptr<KdTree> stored_ = std::make_shared<KdTree>();
    size_t loaded_ = 0; // bytes
};

nb::dict statistics(const TreeHandle &self) {
    TreeStatistics found;
    {
        const nb::gil_scoped_release release;
        found = statistics_of(*self.tree);
    }
    nb::dict dict;
    dict["inner_nodes"] = found.inner_nodes;
    dict["leaves"] = found.leaves;
    dict["empty_leaves"] = found.empty_leaves;
    dict["flat_leaves"] = found.flat_leaves;
    dict["references"] = found.references;
    dict["max_leaf_count"] = found.max_leaf_count;
    dict["unbuilt_cells"] = found.unbuilt_cells;
    dict["unbuilt_references"] = found.unbuilt_references;
    const LazyGrowth *growth = self.tree->growth.get();
    dict["waiting_bytes"] = growth ? growth->state().waiting_bytes : 0;
    const WideTree *wide = self.tree->widening->tree();
    dict["wide_bytes"] = wide ? wide->bytes() : 0;
    dict["depth"] = found.depth;
    dict["expected_traversals"] = found.expected_traversals;
    dict["expected_leaf_visits"] = found.expected_leaf_visits;
    dict["expected_primitive_visits"] = found.expected_primitive_visits;
    dict["leaf_histogram"] = nb::cast(found.leaf_histogram);
    return dict;
}

// Numbers of the triangles that no builder keeps.
nb::object dropped(const TreeHandle &self) {
    std::vector<uint32_t> numbers;
    {
        const nb::gil_scoped_release release;
        const auto &triangles = self.tree->triangles;
        for (size_t i = 0; i < triangles.size(); ++i)
            if (is_degenerate(triangles[i]))
                numbers.push_back(uint32_t(i));
    }
    const size_t count = numbers.size();
    return to_numpy<uint32_t>(std::move(numbers), {count});
}

} // namespace

void bind_tree_files(nb::module_ &m) {
    m.attr("BUILDER_VERSION") = BUILDER_VERSION;
    m.def(
        "build_options",
        [](const nb::kwargs &options) {
            return build_options_to_dict(build_options_from(options));
        },
        "The options as a builder takes them, defaults included.");
    m.def("tree_options",
          [](const TreeHandle &tree) { return build_options_to_dict(tree.options); });
    m.def("tree_statistics", &statistics);
    m.def("tree_dropped", &dropped);
    m.def("tree_is_finished",
          [](const TreeHandle &tree) { return is_finished(*tree.tree); });
    m.def(
        "finish_tree",
        [](const TreeHandle &tree) {
            Watch watch;
            {
                const nb::gil_scoped_release release;
                finish_growth(*tree.tree, [&] { return watch(); });
            }
            watch.rethrow();
        },
        "Builds what a lazy tree has not built yet.");
    m.def(
        "tree_nodes",
        [](const nb::handle_t<TreeHandle> &handle) {
            const KdTree &tree = *nb::cast<const TreeHandle &>(handle).tree;
            return words_of<uint32_t>(tree.nodes.data(), sizes_of(tree).nodes, handle);
        },
        "uint32 (N, 2), split or first reference and the rest of each node, in memory of "
        "the tree.");
    m.def(
        "tree_references",
        [](const nb::handle_t<TreeHandle> &handle) {
            const KdTree &tree = *nb::cast<const TreeHandle &>(handle).tree;
            return words_of<uint32_t>(tree.references.data(), sizes_of(tree).references,
                                      handle);
        },
        "uint32 (R, 1), in memory of the tree.");
    m.def(
        "tree_triangles",
        [](const nb::handle_t<TreeHandle> &handle) {
            const KdTree &tree = *nb::cast<const TreeHandle &>(handle).tree;
            return words_of<float>(tree.triangles.data(), tree.triangles.size(), handle);
        },
        "float32 (F, 9), in memory of the tree.");
    nb::class_<TreeLoader>(m, "TreeLoader")
        .def(nb::init<const Points &, const Faces &>(), nb::arg("vertices"),
             nb::arg("faces"))
        .def_prop_ro("triangles",
                     [](const nb::handle_t<TreeLoader> &self) {
                         const auto &triangles =
                             nb::cast<const TreeLoader &>(self).stored().triangles;
                         return words_of<float>(triangles.data(), triangles.size(), self);
                     })
        .def("reserve", &TreeLoader::reserve, nb::arg("node_count"),
             nb::arg("reference_count"))
        .def("append", &TreeLoader::append, nb::arg("bytes"))
        .def("finish", &TreeLoader::finish, nb::arg("report"), nb::arg("options"),
             "Raises ValueError, with the end of a sentence about the file, unless the "
             "tree can be traversed.");
}

} // namespace mlrt
