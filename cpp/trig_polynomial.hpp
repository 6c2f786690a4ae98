// A trigonometric polynomial from its values at points round the circle.
#pragma once

#include "general_6r_spec.hpp"
#include "polynomial.hpp"

namespace kinverse::KINVERSE_ISA {

// `noise`: coefficients that should vanish, as a part of the largest.
template <int W>
KINVERSE_INLINE TrigPolynomial trig_polynomial(const Pack<W>* value, const TrigTables& table, double& noise) {
  using P = Pack<W>;
  constexpr int PACKS = TRIG_SAMPLES / W;
  TrigPolynomial f;
  double largest = 1e-300, rest = 0.0;
  for (int k = 0; k < TRIG_SAMPLES / 2; ++k) {
    P re(0.0), im(0.0);
    for (int h = 0; h < PACKS; ++h) {
      re = value[h] * load<W>(table.re[k] + W * h) + re;
      im = value[h] * load<W>(table.im[k] + W * h) + im;
    }
    double sum_re = 0.0, sum_im = 0.0;
    for (int l = 0; l < W; ++l) sum_re += re[l], sum_im += im[l];
    const double size = __builtin_fabs(sum_re) + __builtin_fabs(sum_im);
    if (k <= TRIG_DEGREE) {
      f.re[k] = sum_re;
      f.im[k] = sum_im;
      largest = size > largest ? size : largest;
    } else {
      rest = size > rest ? size : rest;
    }
  }
  noise = rest / largest;
  return f;
}

}  // namespace kinverse::KINVERSE_ISA
