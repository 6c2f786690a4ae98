// The solutions of a six-joint arm with two slides, from a polynomial that knows nothing of slides far away.
//
// Slides do not turn anything: the four turning joints close a spherical four-bar by themselves. With
// the driver's angle x given, its opposite follows from a linear equation in cosine and sine, the root
// sigma of whose discriminant D(x) tells the two ways apart, and the others from that. The loop of
// lengths is linear in the slides, so that it closes where
//   g = det[first slide's direction, second one's, all links together] = 0.
// g (times the squared sine N(x) between the two axes beside the driver) is  a(x) + b(x) sigma  with
// trigonometric polynomials a and b, and F = a^2 - D b^2, of degree 8, has the roots of both ways.
#pragma once

#include "se3.hpp"
#include "slide_pair_spec.hpp"
#include "trig_polynomial.hpp"

namespace kinverse::KINVERSE_ISA {

// a + b sigma
template <class P>
struct Split {
  P a, b;
};

// Numbers of that kind; `square` is that of sigma.
template <class P>
struct Splits {
  P square;

  KINVERSE_INLINE Split<P> times(const Split<P>& x, const Split<P>& y) const {
    const P bb = x.b * y.b;
    return {bb * square + x.a * y.a, x.a * y.b + x.b * y.a};
  }
};
template <class P>
KINVERSE_INLINE Split<P> sum(const Split<P>& x, const Split<P>& y) {
  return {x.a + y.a, x.b + y.b};
}
template <class P>
KINVERSE_INLINE Split<P> scaled(P k, const Split<P>& x) {
  return {k * x.a, k * x.b};
}

template <class P>
struct SplitVec {
  Vec3<P> a, b;
};
template <class P>
KINVERSE_INLINE SplitVec<P> cross(const SplitVec<P>& v, const SplitVec<P>& w, P square) {
  return {scaled(square, cross(v.b, w.b)) + cross(v.a, w.a), cross(v.a, w.b) + cross(v.b, w.a)};
}
template <class P>
KINVERSE_INLINE Split<P> dot(const SplitVec<P>& v, const Vec3<P>& w) {
  return {dot(v.a, w), dot(v.b, w)};
}
template <class P>
KINVERSE_INLINE Split<P> dot(const SplitVec<P>& v, const SplitVec<P>& w, P square) {
  return {square * dot(v.b, w.b) + dot(v.a, w.a), dot(v.a, w.b) + dot(v.b, w.a)};
}

// The loop at one pose. Gap k leads from turning joint k - 1 (the driver is 0) to joint k: its rotation,
// its length, and the directions of the slides in it. Gaps 0 and 1 lie beside the driver and are
// written in the frame at their end, gaps 2 and 3 in that at their beginning.
struct SlideLoop {
  double turn[4][9];
  double length[4][3];
  int gap[2];           // of the two slides
  double way[2][3];
  int place[4];         // of the turning joints
  int slide_place[2];
};

inline void multiply3(const double* a, const double* b, double* c) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}

inline SlideLoop slide_loop(const SlidePair& pair, double size, const double* T) {
  double pose[12], inverse[12], half[12];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) inverse[4 * i + j] = T[4 * j + i];
    inverse[4 * i + 3] = -(T[i] * T[3] + T[4 + i] * T[7] + T[8 + i] * T[11]) / size;
  }
  auto multiply = [](const double* a, const double* b, double* c) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 4; ++j)
        c[4 * i + j] = a[4 * i] * b[j] + a[4 * i + 1] * b[4 + j] + a[4 * i + 2] * b[8 + j] + (j == 3 ? a[4 * i + 3] : 0.0);
  };
  multiply(pair.before, inverse, half);
  multiply(half, pair.after, pose);
  SlideLoop loop;
  int turns = 0, slides = 0;
  double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, p[3] = {};
  for (int place = 0; place <= 6; ++place) {
    if (place == 6 || !pair.prismatic[place]) {
      if (turns) {  // a gap ends
        const int gap = turns & 3;
        for (int k = 0; k < 9; ++k) loop.turn[gap][k] = R[k];
        const bool at_end = gap < 2;
        auto kept = [&](const double* v, double* to) {
          for (int k = 0; k < 3; ++k) to[k] = at_end ? R[k] * v[0] + R[3 + k] * v[1] + R[6 + k] * v[2] : v[k];
        };
        kept(p, loop.length[gap]);
        for (int k = 0; k < slides; ++k) {
          if (loop.gap[k] != gap) continue;
          const double way[3] = {loop.way[k][0], loop.way[k][1], loop.way[k][2]};
          kept(way, loop.way[k]);
        }
      }
      if (place == 6) break;
      loop.place[turns++] = place;
      for (int k = 0; k < 9; ++k) R[k] = k % 4 == 0 ? 1.0 : 0.0;
      p[0] = p[1] = p[2] = 0.0;
    } else {
      loop.slide_place[slides] = place;
      loop.gap[slides] = turns & 3;
      for (int k = 0; k < 3; ++k) loop.way[slides][k] = R[3 * k + 2];
      ++slides;
    }
    const double* link = place == pair.pose_link ? pose : pair.link[place];
    for (int k = 0; k < 3; ++k) p[k] += R[3 * k] * link[3] + R[3 * k + 1] * link[7] + R[3 * k + 2] * link[11];
    const double turn[9] = {link[0], link[1], link[2], link[4], link[5], link[6], link[8], link[9], link[10]};
    double next[9];
    multiply3(R, turn, next);
    for (int k = 0; k < 9; ++k) R[k] = next[k];
  }
  return loop;
}

template <class P>
KINVERSE_INLINE Vec3<P> turned(const double* m, const Vec3<P>& v) {
  return {P(m[0]) * v.x + (P(m[1]) * v.y + P(m[2]) * v.z), P(m[3]) * v.x + (P(m[4]) * v.y + P(m[5]) * v.z),
          P(m[6]) * v.x + (P(m[7]) * v.y + P(m[8]) * v.z)};
}
template <class P>
KINVERSE_INLINE Vec3<P> turned_back(const double* m, const Vec3<P>& v) {
  return {P(m[0]) * v.x + (P(m[3]) * v.y + P(m[6]) * v.z), P(m[1]) * v.x + (P(m[4]) * v.y + P(m[7]) * v.z),
          P(m[2]) * v.x + (P(m[5]) * v.y + P(m[8]) * v.z)};
}
template <class P>
KINVERSE_INLINE Vec3<P> constant(const double* v) {
  return {P(v[0]), P(v[1]), P(v[2])};
}
template <class P>
KINVERSE_INLINE Vec3<P> about_z(const Vec3<P>& v, P c, P s) {
  return {c * v.x - s * v.y, s * v.x + c * v.y, v.z};
}

// Everything in the frame behind joint 1; the driver's angle in the lanes.
template <class P>
struct FourBar {
  P square;            // D
  Split<P> cos_2, sin_2;
  Vec3<P> q, row;      // third column and third row of what joints 1, 2 and 3 make together
  P n;                 // N
  Split<P> cos_1, sin_1;  // times N
  Vec3<P> base;        // links of gaps 0 and 1, before joint 1 turns them back
  SplitVec<P> own;     // links of gaps 2 and 3
  Vec3<P> way_base[2];
  SplitVec<P> way_own[2];
  Split<P> g;

  KINVERSE_INLINE FourBar(const SlideLoop& loop, P c, P s) {
    const double *A0 = loop.turn[1], *A1 = loop.turn[2], *A2 = loop.turn[3], *A3 = loop.turn[0];
    const P zero(0.0);
    auto back = [&](const Vec3<P>& v) { return turned_back(A0, about_z(v, c, -s)); };
    q = back({P(A3[6]), P(A3[7]), P(A3[8])});
    // (A0 e_z)^T Rz(-x) A3^T
    row = turned(A3, about_z(Vec3<P>{P(A0[2]), P(A0[5]), P(A0[8])}, c, s));
    // joint 2: alpha cos + beta sin = gamma
    const double u = A2[2], v = A2[5], w = A2[8], p1 = A1[6], p2 = A1[7], p3 = A1[8];
    const double alpha = p1 * u + p2 * v, beta = p2 * u - p1 * v, h2 = alpha * alpha + beta * beta;
    const P gamma = q.z - P(p3 * w);
    square = P(h2) - gamma * gamma;
    cos_2 = {P(alpha / h2) * gamma, P(-beta / h2)};
    sin_2 = {P(beta / h2) * gamma, P(alpha / h2)};
    const SplitVec<P> m = through_2(A1, Vec3<P>{P(u), P(v), P(w)});
    n = q.x * q.x + q.y * q.y;
    cos_1 = {m.a.x * q.x + m.a.y * q.y, m.b.x * q.x + m.b.y * q.y};
    sin_1 = {m.a.x * q.y - m.a.y * q.x, m.b.x * q.y - m.b.y * q.x};
    base = constant<P>(loop.length[1]) + back(constant<P>(loop.length[0]));
    own = through_2(A1, constant<P>(loop.length[3]));
    own.a = own.a + constant<P>(loop.length[2]);
    for (int k = 0; k < 2; ++k) {
      const Vec3<P> way = constant<P>(loop.way[k]);
      if (loop.gap[k] == 0) way_base[k] = back(way);
      if (loop.gap[k] == 1) way_base[k] = way;
      if (loop.gap[k] == 2) way_own[k] = {way, {zero, zero, zero}};
      if (loop.gap[k] == 3) way_own[k] = through_2(A1, way);
    }
    const bool base_0 = loop.gap[0] < 2, base_1 = loop.gap[1] < 2;
    if (base_0 && base_1) {
      const Vec3<P> normal = cross(way_base[0], way_base[1]);
      g = sum({n * dot(normal, base), zero}, dot(through_1(own), normal));
    } else if (!base_0 && !base_1) {
      const SplitVec<P> normal = cross(way_own[0], way_own[1], square);
      g = sum(scaled(n, dot(normal, own, square)), dot(through_1(normal), base));
    } else {
      const Vec3<P>& here = way_base[base_0 ? 0 : 1];
      const SplitVec<P>& there = way_own[base_0 ? 1 : 0];
      g = sum(dot(through_1(cross(there, own, square)), here), dot(through_1(there), cross(base, here)));
    }
  }

  // A1 Rz(joint 2) v
  KINVERSE_INLINE SplitVec<P> through_2(const double* A1, const Vec3<P>& v) const {
    const Vec3<P> a{cos_2.a * v.x - sin_2.a * v.y, sin_2.a * v.x + cos_2.a * v.y, v.z};
    const Vec3<P> b{cos_2.b * v.x - sin_2.b * v.y, sin_2.b * v.x + cos_2.b * v.y, P(0.0)};
    return {turned(A1, a), turned(A1, b)};
  }
  // N Rz(joint 1) v
  KINVERSE_INLINE SplitVec<P> through_1(const SplitVec<P>& v) const {
    const Splits<P> ring{square};
    const Split<P> x{v.a.x, v.b.x}, y{v.a.y, v.b.y};
    const Split<P> cx = ring.times(cos_1, x), sy = ring.times(sin_1, y), sx = ring.times(sin_1, x), cy = ring.times(cos_1, y);
    return {{cx.a - sy.a, sx.a + cy.a, n * v.a.z}, {cx.b - sy.b, sx.b + cy.b, n * v.b.z}};
  }
};

template <int W>
KINVERSE_INLINE TrigPolynomial characteristic(const SlideLoop& loop, const TrigTables& table, double& noise, double& largest) {
  using P = Pack<W>;
  constexpr int PACKS = TRIG_SAMPLES / W;
  P value[PACKS], most(0.0);
  for (int h = 0; h < PACKS; ++h) {
    const FourBar<P> bar(loop, load<W>(table.c + W * h), load<W>(table.s + W * h));
    const P a2 = bar.g.a * bar.g.a, b2 = bar.g.b * bar.g.b, rest = b2 * bar.square;
    value[h] = a2 - rest;
    most = max(most, P(a2 + abs(rest)));
  }
  largest = 0.0;
  for (int l = 0; l < W; ++l) largest = most[l] > largest ? most[l] : largest;
  return trig_polynomial<W>(value, table, noise);
}

// From roots in x to the values of the joints at all six places; in lanes that are `flipped` the other
// way of the four-bar. `both`: where both ways may be roots. `apart`: the squared sine between the slides.
template <int W>
KINVERSE_INLINE void close_loop(const SlideLoop& loop, double largest, Pack<W> x, Mask<W> flipped, Pack<W>* v,
                                Mask<W>& both, Pack<W>& apart) {
  using P = Pack<W>;
  P s, c;
  sincos(x, s, c);
  const FourBar<P> bar(loop, c, s);
  const P size = sqrt(max(bar.square, P(0.0)));
  const Mask<W> same_sign = P(bar.g.a * bar.g.b) > P(0.0);
  P sigma = select(same_sign, -size, size);
  const P rest = P(bar.g.b * bar.g.b) * size * size;
  both = P(bar.g.a * bar.g.a + rest) < P(1e-6 * largest);
  sigma = select(flipped, -sigma, sigma);
  auto at = [&](const Split<P>& y) -> P { return y.b * sigma + y.a; };
  auto vector_at = [&](const SplitVec<P>& y) -> Vec3<P> { return scaled(sigma, y.b) + y.a; };
  const P c2 = at(bar.cos_2), s2 = at(bar.sin_2);
  const double *A1 = loop.turn[2], *A2 = loop.turn[3];
  const Vec3<P> k = turned_back(A2, about_z(Vec3<P>{P(A1[6]), P(A1[7]), P(A1[8])}, c2, -s2));
  P c1 = at(bar.cos_1), s1 = at(bar.sin_1);
  v[loop.place[0]] = x;
  v[loop.place[1]] = atan2(s1, c1);
  v[loop.place[2]] = atan2(s2, c2);
  v[loop.place[3]] = atan2(P(k.y * bar.row.x - k.x * bar.row.y), P(k.x * bar.row.x + k.y * bar.row.y));
  sincos(v[loop.place[1]], s1, c1);
  const Vec3<P> open = vector_at(bar.own) + about_z(bar.base, c1, -s1);
  Vec3<P> way[2];
  for (int j = 0; j < 2; ++j) way[j] = loop.gap[j] < 2 ? about_z(bar.way_base[j], c1, -s1) : vector_at(bar.way_own[j]);
  const P e = dot(way[0], way[1]), r0 = -dot(way[0], open), r1 = -dot(way[1], open);
  apart = P(1.0) - e * e;
  const P scale = P(1.0) / max(apart, P(1e-12));
  v[loop.slide_place[0]] = P(r0 - e * r1) * scale;
  v[loop.slide_place[1]] = P(r1 - e * r0) * scale;
}

}  // namespace kinverse::KINVERSE_ISA
