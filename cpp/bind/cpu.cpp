// Which of the modules beside this one may be loaded on this processor. Built for the
// oldest processor of the family, so that importing it is always safe.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#include <string>
#include <vector>

namespace nb = nanobind;

namespace {

std::vector<std::string> supported_isas() {
    std::vector<std::string> names;
#if defined(__x86_64__)
    if (__builtin_cpu_supports("x86-64-v4"))
        names.emplace_back("avx512");
    if (__builtin_cpu_supports("x86-64-v3"))
        names.emplace_back("avx2");
#else
    names.emplace_back("native");
#endif
    return names;
}

} // namespace

NB_MODULE(_cpu, m) {
    m.def("supported_isas", &supported_isas,
          "Names of the instruction sets that this processor and its operating system "
          "support, "
          "the widest first.");
}
