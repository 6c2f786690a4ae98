// Roots of a real trigonometric polynomial of degree 8, all at once.
#pragma once

#include "simd.hpp"

namespace kinverse::KINVERSE_ISA {

constexpr int TRIG_DEGREE = 8;
constexpr int TRIG_ROOTS = 2 * TRIG_DEGREE;

// sum_k c_k e^{ikt}, k = -8..8, with c_{-k} the conjugate of c_k
struct TrigPolynomial {
  double re[TRIG_DEGREE + 1], im[TRIG_DEGREE + 1];
};

// z = e^{it} of every root, real or not, by the simultaneous iteration of Ehrlich and Aberth from
// points scattered about the unit circle. Real roots lie on it; the others in pairs (z, 1 / conj z).
// What flies off is held at a distance, where it does no harm to the roots near the circle.
template <int W>
KINVERSE_INLINE void trig_roots(const TrigPolynomial& f, double* re, double* im) {
  using P = Pack<W>;
  constexpr int PACKS = TRIG_ROOTS / W;
  double cr[TRIG_ROOTS + 1], ci[TRIG_ROOTS + 1], scale = 1e-300;
  for (int k = 0; k <= TRIG_DEGREE; ++k) {
    const double size = __builtin_fabs(f.re[k]) + __builtin_fabs(f.im[k]);
    scale = size > scale ? size : scale;
  }
  for (int k = 0; k <= TRIG_DEGREE; ++k) {
    cr[TRIG_DEGREE + k] = f.re[k] / scale;
    ci[TRIG_DEGREE + k] = f.im[k] / scale;
    cr[TRIG_DEGREE - k] = f.re[k] / scale;
    ci[TRIG_DEGREE - k] = -f.im[k] / scale;
  }
  alignas(64) double zr[TRIG_ROOTS], zi[TRIG_ROOTS];
  for (int first = 0; first < TRIG_ROOTS; first += W) {
    alignas(64) double radius[W], angle[W];
    for (int l = 0; l < W; ++l) {
      const int k = first + l;
      radius[l] = 1.0 + 0.25 * ((k * 7 % 16) / 15.0 - 0.5) * (k & 1 ? 1.0 : -1.3);
      angle[l] = TWO_PI * (k + 0.37) / TRIG_ROOTS;
    }
    P s, c;
    sincos(load<W>(angle), s, c);
    store(zr + first, P(load<W>(radius) * c));
    store(zi + first, P(load<W>(radius) * s));
  }
  constexpr double FAR = 30.0;
  for (int round = 0; round < 60; ++round) {
    P moved(0.0);
    P next_r[PACKS], next_i[PACKS];
    for (int h = 0; h < PACKS; ++h) {
      const P x = load<W>(zr + W * h), y = load<W>(zi + W * h);
      P ar(cr[TRIG_ROOTS]), ai(ci[TRIG_ROOTS]), br(0.0), bi(0.0);
      for (int k = TRIG_ROOTS - 1; k >= 0; --k) {
        P t = br * x - (bi * y - ar);
        bi = br * y + (bi * x + ai);
        br = t;
        t = ar * x - (ai * y - P(cr[k]));
        ai = ar * y + (ai * x + P(ci[k]));
        ar = t;
      }
      const P inverse = P(1.0) / max(P(br * br + bi * bi), P(1e-290));
      const P wr = (ar * br + ai * bi) * inverse, wi = (ai * br - ar * bi) * inverse;
      P sr(0.0), si(0.0);
      for (int j = 0; j < TRIG_ROOTS; ++j) {
        const P dx = x - P(zr[j]), dy = y - P(zi[j]);
        const P m = dx * dx + dy * dy;
        const P part = select(m > P(0.0), P(1.0) / max(m, P(1e-280)), P(0.0));
        sr = dx * part + sr;
        si = si - dy * part;
      }
      const P er = P(1.0) - (wr * sr - wi * si), ei = -P(wr * si + wi * sr);
      const P q = P(1.0) / max(P(er * er + ei * ei), P(1e-290));
      P ur = (wr * er + wi * ei) * q, ui = (wi * er - wr * ei) * q;
      P nr = x - ur, ni = y - ui;
      P size2 = nr * nr + ni * ni;
      const P pull = select(size2 > P(FAR * FAR), P(FAR) / sqrt(max(size2, P(1.0))), P(1.0));
      // not a number: start again on the circle
      const Mask<W> usable = size2 < P(1e300);
      nr = select(usable, P(nr * pull), P(0.6));
      ni = select(usable, P(ni * pull), P(0.8));
      size2 = x * x + y * y;
      const P step2 = ur * ur + ui * ui;
      moved = max(moved, select((size2 > P(0.25)) & (size2 < P(4.0)), step2, P(0.0)));
      next_r[h] = nr;
      next_i[h] = ni;
    }
    for (int h = 0; h < PACKS; ++h) {
      store(zr + W * h, next_r[h]);
      store(zi + W * h, next_i[h]);
    }
    if (!any(moved > P(1e-18))) break;
  }
  for (int k = 0; k < TRIG_ROOTS; ++k) {
    re[k] = zr[k];
    im[k] = zi[k];
  }
}

}  // namespace kinverse::KINVERSE_ISA
