// What the tests ask of the floating-point environment of the core, and of its packets.
#include "base/partial_packets.h"
#include "bind/arrays.h"
#include "bind/bind.h"

#include <vector>

namespace mlrt {

namespace {

// a * b - c, which differs from its fused evaluation for suitable arguments: a test feeds
// it such arguments to prove that the compiler did not contract it.
float multiply_subtract(float a, float b, float c) {
    return a * b - c;
}

using FloatArray = nanobind::ndarray<const float, nanobind::ndim<1>, nanobind::device::cpu,
                                     nanobind::c_contig>;

// Of sixteen values those whose bit is set, one after the other.
nanobind::object compressed(const FloatArray &values, LaneBits bits) {
    std::vector<float> kept(2 * PACKET_WIDTH);
    store_compressed(kept.data(), load<FloatPacket>(values.data()), bits);
    const size_t count = size_t(__builtin_popcount(bits));
    kept.resize(count);
    return to_numpy<float>(std::move(kept), {count});
}

// The first values, fewer than there are lanes, and zeros.
template <typename Packet>
nanobind::object padded(const FloatArray &values, int32_t count) {
    constexpr size_t WIDTH = LANES_OF<Packet>;
    std::vector<float> lanes(WIDTH);
    store(lanes.data(), load_first<Packet>(values.data(), uint32_t(count)));
    return to_numpy<float>(std::move(lanes), {WIDTH});
}

} // namespace

void bind_numerics(nanobind::module_ &m) {
    m.def("multiply_subtract", &multiply_subtract);
    m.def("compressed", &compressed);
    m.def("padded", &padded<FloatPacket>);
    m.def("padded_block", &padded<FloatBlock>);
}

} // namespace mlrt
