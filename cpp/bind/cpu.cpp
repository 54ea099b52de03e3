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
    // The modules are built for the levels x86-64-v3 and v4. Compilers do not agree on the
    // names of levels here, so this asks for the features that tell processors of a level
    // apart.
    const bool level_3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                         __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
    const bool level_4 =
        level_3 && __builtin_cpu_supports("avx512f") &&
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    if (level_4)
        names.emplace_back("avx512");
    if (level_3)
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
