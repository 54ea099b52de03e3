// What a tree consists of, for those who store, load and measure trees.
#include "bind/arrays.h"
#include "bind/bind.h"
#include "bind/build_options.h"
#include "bind/mesh_arrays.h"
#include "bind/tree_handle.h"
#include "geometry/degenerate.h"
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

// A list as an array (N, words) that borrows it and keeps its owner alive.
template <typename T, typename List>
nb::object words_of(const List &list, size_t words, nb::handle owner) {
    const auto *data = reinterpret_cast<const T *>(list.data());
    return nb::ndarray<nb::numpy, const T>(data, {list.size(), words}, owner).cast();
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
    m.def(
        "tree_nodes",
        [](const nb::handle_t<TreeHandle> &tree) {
            return words_of<uint32_t>(nb::cast<const TreeHandle &>(tree).tree->nodes, 2,
                                      tree);
        },
        "uint32 (N, 2), split or first reference and the rest of each node, in memory of "
        "the tree.");
    m.def(
        "tree_references",
        [](const nb::handle_t<TreeHandle> &tree) {
            return words_of<uint32_t>(nb::cast<const TreeHandle &>(tree).tree->references,
                                      1, tree);
        },
        "uint32 (R, 1), in memory of the tree.");
    m.def(
        "tree_triangles",
        [](const nb::handle_t<TreeHandle> &tree) {
            return words_of<float>(nb::cast<const TreeHandle &>(tree).tree->triangles, 9,
                                   tree);
        },
        "float32 (F, 9), in memory of the tree.");
    nb::class_<TreeLoader>(m, "TreeLoader")
        .def(nb::init<const Points &, const Faces &>(), nb::arg("vertices"),
             nb::arg("faces"))
        .def_prop_ro("triangles",
                     [](const nb::handle_t<TreeLoader> &self) {
                         const auto &loader = nb::cast<const TreeLoader &>(self);
                         return words_of<float>(loader.stored().triangles, 9, self);
                     })
        .def("reserve", &TreeLoader::reserve, nb::arg("node_count"),
             nb::arg("reference_count"))
        .def("append", &TreeLoader::append, nb::arg("bytes"))
        .def("finish", &TreeLoader::finish, nb::arg("report"), nb::arg("options"),
             "Raises ValueError, with the end of a sentence about the file, unless the "
             "tree can be traversed.");
}

} // namespace mlrt
