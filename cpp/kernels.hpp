// The table of functions that each instruction set compiles for itself (kernels.cpp).
#pragma once

#include "chain.hpp"

namespace kinverse {

struct Kernels {
  const char* name;
  int lanes;
  // q (count, dof) -> T (count, 16)
  void (*forward)(const Chain& chain, const double* q, long count, double* T);
  // the same, one configuration at a time: what the lanes are measured against
  void (*forward_one_lane)(const Chain& chain, const double* q, long count, double* T);
  // q (count, dof) -> J (count, 6, dof)
  void (*jacobian)(const Chain& chain, const double* q, long count, double* J);
};

namespace baseline {
extern const Kernels KERNELS;
}
namespace avx2 {
extern const Kernels KERNELS;
}
namespace avx512 {
extern const Kernels KERNELS;
}

}  // namespace kinverse
