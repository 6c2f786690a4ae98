// The characteristic polynomial of a six-joint arm at one pose: two joints removed by what was found
// once per arm, two more by a resultant, one left.
//
// Raghavan & Roth (1993): 14 invariants of the line of joint f are sums of products of
// (cos, sin, 1) of two joints on either side of the loop. Six combinations are free of a and b; with
// half-angles of d and e and their multiples by the half-angle of d they make a 12 x 12 matrix, linear
// in cos and sin of c. Its determinant is a trigonometric polynomial of degree 8, sampled in lanes.
// Where a joint slides, its basis (v^2, v, 1) takes the place of (cos, sin, 1), and nothing else changes;
// two slides would make the matrix singular everywhere (slide_pair.hpp).
#pragma once

#include "general_6r_spec.hpp"
#include "trig_polynomial.hpp"
#include "se3.hpp"

namespace kinverse::KINVERSE_ISA {

template <class P>
struct Line {
  Vec3<P> p, l;  // a point on it, its direction
};

template <class P>
KINVERSE_INLINE Line<P> moved_line(const double* m, const Line<P>& line) {
  auto turned = [&](const Vec3<P>& v) -> Vec3<P> {
    return {P(m[0]) * v.x + (P(m[1]) * v.y + P(m[2]) * v.z), P(m[4]) * v.x + (P(m[5]) * v.y + P(m[6]) * v.z),
            P(m[8]) * v.x + (P(m[9]) * v.y + P(m[10]) * v.z)};
  };
  const Vec3<P> p = turned(line.p);
  return {{p.x + P(m[3]), p.y + P(m[7]), p.z + P(m[11])}, turned(line.l)};
}

template <class P>
KINVERSE_INLINE void invariants(const Line<P>& line, P* f) {
  const Vec3<P>&p = line.p, &l = line.l;
  const P pp = dot(p, p), pl = dot(p, l);
  const Vec3<P> m = cross(p, l);
  const P twice = pl + pl;
  f[0] = p.x, f[1] = p.y, f[2] = p.z;
  f[3] = l.x, f[4] = l.y, f[5] = l.z;
  f[6] = pp, f[7] = pl;
  f[8] = m.x, f[9] = m.y, f[10] = m.z;
  f[11] = pp * l.x - twice * p.x;
  f[12] = pp * l.y - twice * p.y;
  f[13] = pp * l.z - twice * p.z;
}

// before * X * after with plain numbers; X is T in units of `size`, or its inverse
inline void pose_link(const Elimination& e, double size, const double* T, double* link) {
  double x[12];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) x[4 * i + j] = e.pose_inverted ? T[4 * j + i] : T[4 * i + j];
  for (int i = 0; i < 3; ++i) {
    double p = T[4 * i + 3] / size;
    if (e.pose_inverted) p = -(T[i] * T[3] + T[4 + i] * T[7] + T[8 + i] * T[11]) / size;
    x[4 * i + 3] = p;
  }
  double y[12];
  auto multiply = [](const double* a, const double* b, double* c) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 4; ++j)
        c[4 * i + j] = a[4 * i] * b[j] + a[4 * i + 1] * b[4 + j] + a[4 * i + 2] * b[8 + j] + (j == 3 ? a[4 * i + 3] : 0.0);
  };
  multiply(e.before, x, y);
  multiply(y, e.after, link);
}

// coefficient[r][m][power of d and e]: six equations, m over the basis of c
struct Equations {
  alignas(64) double coefficient[6][3 * 9 + 5];
};

template <int W>
KINVERSE_INLINE void equations(const Elimination& e, const double* link, Equations& out) {
  using P = Pack<W>;
  auto link_at = [&](int place) { return place == e.pose_link ? link : e.link[place]; };
  double g[6][PADDED_SAMPLES];
  for (int first = 0; first < PADDED_SAMPLES; first += W) {
    const double* s = link_at(E);
    Line<P> line{{P(s[3]), P(s[7]), P(s[11])}, {P(s[2]), P(s[6]), P(s[10])}};
    for (int joint = 2; joint >= 0; --joint) {
      P m[12];
      for (int k = 0; k < 12; ++k) m[k] = load<W>(e.motion[joint][k] + first);
      auto turned = [&](const Vec3<P>& v) -> Vec3<P> {
        return {m[0] * v.x + (m[1] * v.y + m[2] * v.z), m[4] * v.x + (m[5] * v.y + m[6] * v.z),
                m[8] * v.x + (m[9] * v.y + m[10] * v.z)};
      };
      line = {turned(line.p) + Vec3<P>{m[3], m[7], m[11]}, turned(line.l)};
      line = moved_line(link_at(B + joint), line);
    }
    P f[INVARIANTS];
    invariants(line, f);
    for (int r = 0; r < 6; ++r) {
      P sum(-e.annihilate_constant[r]);
      for (int k = 0; k < INVARIANTS; ++k) sum = P(e.annihilate[r][k]) * f[k] + sum;
      store(g[r] + first, sum);
    }
  }
  for (int r = 0; r < 6; ++r)
    for (int first = 0; first < PADDED_SAMPLES; first += W) {
      P sum(0.0);
      for (int s = 0; s < SAMPLES; ++s) sum = P(g[r][s]) * load<W>(e.to_coefficients[s] + first) + sum;
      store(out.coefficient[r] + first, sum);
    }
}

// Householder reflections from column `from` on to the end of the row range that `last_row` gives
// for each column; returns the product of the diagonal. What is below it is not written.
template <class P, int ROWS, int COLUMNS, class LastRow>
KINVERSE_INLINE P triangular(P (&m)[ROWS][COLUMNS], int columns, LastRow last_row) {
  P product(1.0);
  for (int j = 0; j < columns; ++j) {
    const int rows = last_row(j);
    P n2 = m[j][j] * m[j][j];
    for (int r = j + 1; r < rows; ++r) n2 = m[r][j] * m[r][j] + n2;
    const P n = sqrt(n2);
    const P diagonal = select(m[j][j] > P(0.0), -n, n);
    const P beta = P(1.0) / max(P(n2 - diagonal * m[j][j]), P(1e-290));
    P v[ROWS];
    for (int r = j; r < rows; ++r) v[r] = m[r][j];
    v[j] = v[j] - diagonal;
    for (int k = j + 1; k < COLUMNS; ++k) {
      P w = v[j] * m[j][k];
      for (int r = j + 1; r < rows; ++r) w = v[r] * m[r][k] + w;
      w = w * beta;
      for (int r = j; r < rows; ++r) m[r][k] = m[r][k] - v[r] * w;
    }
    m[j][j] = diagonal;
    product = product * diagonal;
  }
  return product;
}

// The determinant of the 12 x 12 matrix at (cos, sin) of c, and if asked its null vector, ordered by
// falling powers of d (3..0), then of e (2..0). The matrix is two shifted copies of the six
// equations: reducing the three leading columns once serves both.
template <int W, bool NULL_VECTOR>
__attribute__((noinline)) void resultant(const Equations& equations, const Pack<W>& c, const Pack<W>& s,
                                         Pack<W>& determinant, Pack<W>* x) {
  using P = Pack<W>;
  P a[6][9];
  for (int r = 0; r < 6; ++r)
    for (int k = 0; k < 9; ++k) {
      const double* g = equations.coefficient[r] + k;
      a[r][k] = P(g[0]) * c + (P(g[9]) * s + P(g[18]));
    }
  const P leading = triangular(a, 3, [](int) { return 6; });
  P m[9][9];
  for (int r = 0; r < 3; ++r)
    for (int k = 0; k < 9; ++k) {
      m[r][k] = k < 6 ? a[3 + r][3 + k] : P(0.0);
      m[3 + r][k] = k < 3 && k < r ? P(0.0) : a[r][k];
      m[6 + r][k] = k < 3 ? P(0.0) : a[3 + r][k];
    }
  determinant = leading * triangular(m, 9, [](int j) { return j < 3 ? 4 + j : 9; });
  if constexpr (NULL_VECTOR) {
    auto quotient = [](P t, P d) { return t / select(abs(d) > P(1e-280), d, P(1e-280)); };
    x[11] = P(1.0);
    for (int i = 7; i >= 0; --i) {
      P t(0.0);
      for (int k = i + 1; k < 9; ++k) t = t - m[i][k] * x[3 + k];
      x[3 + i] = quotient(t, m[i][i]);
    }
    for (int i = 2; i >= 0; --i) {
      P t(0.0);
      for (int k = i + 1; k < 9; ++k) t = t - a[i][k] * x[k];
      x[i] = quotient(t, a[i][i]);
    }
  }
}

template <int W>
KINVERSE_INLINE TrigPolynomial characteristic(const Equations& equations, const TrigTables& table, double& noise) {
  using P = Pack<W>;
  constexpr int PACKS = TRIG_SAMPLES / W;
  P value[PACKS];
  for (int h = 0; h < PACKS; ++h)
    resultant<W, false>(equations, load<W>(table.c + W * h), load<W>(table.s + W * h), value[h], nullptr);
  return trig_polynomial<W>(value, table, noise);
}

}  // namespace kinverse::KINVERSE_ISA
