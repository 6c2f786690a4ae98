// The only file that knows Python.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "dispatch.hpp"
#include "owned_chain.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace kinverse;

namespace {

template <class T, int N>
using In = nb::ndarray<const T, nb::ndim<N>, nb::c_contig, nb::device::cpu>;

template <class T>
nb::ndarray<nb::numpy, T> owned_array(std::vector<size_t> shape) {
  size_t count = 1;
  for (size_t extent : shape) count *= extent;
  T* data = new T[count ? count : 1];
  nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return nb::ndarray<nb::numpy, T>(data, shape.size(), shape.data(), owner);
}

void require(bool condition, const char* message) {
  if (!condition) throw nb::value_error(message);
}

OwnedChain make_chain(In<double, 3> frames, In<std::uint8_t, 1> prismatic, In<int, 1> source, In<double, 1> multiplier,
                      In<double, 1> offset, In<double, 2> limits) {
  size_t joints = prismatic.shape(0), dof = limits.shape(0);
  require(joints >= 1 && joints <= MAX_JOINTS, "a chain has 1 to 32 moving joints");
  require(dof >= 1 && dof <= joints, "a chain has at least one free joint and not more than moving joints");
  require(frames.shape(0) == joints + 1 && frames.shape(1) == 4 && frames.shape(2) == 4,
          "frames must have the shape (joints + 1, 4, 4)");
  require(source.shape(0) == joints && multiplier.shape(0) == joints && offset.shape(0) == joints,
          "source, multiplier and offset must have one entry per moving joint");
  require(limits.shape(1) == 2, "limits must have the shape (dof, 2)");
  OwnedChain chain;
  for (size_t i = 0; i <= joints; ++i)
    chain.frames.insert(chain.frames.end(), frames.data() + 16 * i, frames.data() + 16 * i + 12);
  chain.prismatic.assign(prismatic.data(), prismatic.data() + joints);
  chain.source.assign(source.data(), source.data() + joints);
  for (int free_joint : chain.source)
    require(free_joint >= 0 && free_joint < static_cast<int>(dof), "source names a free joint that is not there");
  chain.multiplier.assign(multiplier.data(), multiplier.data() + joints);
  chain.offset.assign(offset.data(), offset.data() + joints);
  for (size_t j = 0; j < dof; ++j) {
    chain.lower.push_back(limits(j, 0));
    chain.upper.push_back(limits(j, 1));
  }
  return chain;
}

nb::ndarray<nb::numpy, double> forward(const OwnedChain& chain, In<double, 2> q, bool one_lane) {
  require(q.shape(1) == static_cast<size_t>(chain.dof()), "q must have one column per free joint");
  auto T = owned_array<double>({q.shape(0), 4, 4});
  const Kernels& kernels = active_kernels();
  auto run = one_lane ? kernels.forward_one_lane : kernels.forward;
  const double* from = q.data();
  double* to = T.data();
  nb::gil_scoped_release unlocked;
  split_over_threads(static_cast<long>(q.shape(0)), 1024, [&](long first, long last, long) {
    run(chain.view(), from + first * chain.dof(), last - first, to + 16 * first);
  });
  return T;
}

nb::ndarray<nb::numpy, double> jacobian(const OwnedChain& chain, In<double, 2> q) {
  require(q.shape(1) == static_cast<size_t>(chain.dof()), "q must have one column per free joint");
  size_t dof = static_cast<size_t>(chain.dof());
  auto J = owned_array<double>({q.shape(0), 6, dof});
  const double* from = q.data();
  double* to = J.data();
  nb::gil_scoped_release unlocked;
  split_over_threads(static_cast<long>(q.shape(0)), 1024, [&](long first, long last, long) {
    active_kernels().jacobian(chain.view(), from + first * dof, last - first, to + 6 * dof * first);
  });
  return J;
}

}  // namespace

NB_MODULE(_core, m) {
  m.def("set_threads", &set_thread_count, "count"_a);
  m.def("threads", &thread_count);
  m.def("instruction_sets", [] {
    std::vector<std::string> names;
    for (const Kernels* kernels : available_kernels()) names.push_back(kernels->name);
    return names;
  });
  m.def("instruction_set", [] { return std::string(active_kernels().name); });
  m.def("lanes", [] { return active_kernels().lanes; });
  m.def("set_instruction_set", &set_active_kernels, "name"_a);

  nb::class_<OwnedChain>(m, "Chain")
      .def("__init__",
           [](OwnedChain* self, In<double, 3> frames, In<std::uint8_t, 1> prismatic, In<int, 1> source,
              In<double, 1> multiplier, In<double, 1> offset, In<double, 2> limits) {
             new (self) OwnedChain(make_chain(frames, prismatic, source, multiplier, offset, limits));
           },
           "frames"_a, "prismatic"_a, "source"_a, "multiplier"_a, "offset"_a, "limits"_a)
      .def_prop_ro("dof", &OwnedChain::dof)
      .def("fk", &forward, "q"_a, "one_lane"_a = false)
      .def("jacobian", &jacobian, "q"_a);
}
