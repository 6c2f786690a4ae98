// All solutions of a six-joint arm that no special family fits, one pose at a time.
//
// Raghavan & Roth (1993): 14 invariants of the line of joint f are sums of products of
// (cos, sin, 1) of two joints on either side of the loop. Six combinations are free of a and b; with
// half-angles of d and e and their multiples by the half-angle of d they make a 12 x 12 matrix, linear
// in cos and sin of c. Its determinant is a trigonometric polynomial of degree 8, sampled in lanes.
// A slide is a turn about an axis far away (`bend` is the reciprocal distance): its basis
// (v^2, v, 1) takes the place of (cos, sin, 1), and nothing else changes.
#pragma once

#include "candidate.hpp"
#include "general_6r_spec.hpp"
#include "kernels.hpp"
#include "polynomial.hpp"

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

// The motion of a joint with loop value v, as 12 packs. A bent slide turns about the x direction
// through the point (0, -1 / bend, 0).
template <class P>
KINVERSE_INLINE Frame<P> joint_motion(bool prismatic, double bend, P v) {
  const P zero(0.0), one(1.0);
  if (!prismatic) {
    P s, c;
    sincos(v, s, c);
    return {{c, s, zero}, {-s, c, zero}, {zero, zero, one}, {zero, zero, zero}};
  }
  const P half = P(0.5 * bend) * v;
  const P scale = one / (half * half + one);
  const P s = (half + half) * scale;
  const P versed = P((half + half) * half) * scale;
  const P c = one - versed;
  const P along = v * scale;
  return {{one, zero, zero}, {zero, c, s}, {zero, -s, c}, {zero, -P(along * half), along}};
}
template <class P>
KINVERSE_INLINE Frame<P> times(const Frame<P>& a, const Frame<P>& b) {
  auto turned = [&](const Vec3<P>& v) -> Vec3<P> {
    return {a.x.x * v.x + (a.y.x * v.y + a.z.x * v.z), a.x.y * v.x + (a.y.y * v.y + a.z.y * v.z),
            a.x.z * v.x + (a.y.z * v.y + a.z.z * v.z)};
  };
  return {turned(b.x), turned(b.y), turned(b.z), turned(b.p) + a.p};
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

// v = 2 atan(numerator / denominator), or their quotient for a slide
template <int W>
KINVERSE_INLINE Pack<W> from_half(bool prismatic, Pack<W> numerator, Pack<W> denominator) {
  using P = Pack<W>;
  if (prismatic) return numerator / select(abs(denominator) > P(1e-12) * abs(numerator), denominator, P(1e-12));
  return P(2.0) * atan2(numerator, denominator);
}

// From roots in c to all six joints on the loop of the elimination.
template <int W>
KINVERSE_INLINE void back_substitute(const Elimination& e, const double* link, const Equations& equations, Pack<W> vc,
                                     Pack<W>* v) {
  using P = Pack<W>;
  auto link_at = [&](int place) { return place == e.pose_link ? link : e.link[place]; };
  P c, s, unused, x[12];
  sincos(vc, s, c);
  resultant<W, true>(equations, c, s, unused, x);
  v[C] = vc;
  {
    // e: within the row of d's power that is larger; numerator over denominator from its larger end
    const Mask<W> high = abs(x[0]) + abs(x[1]) + abs(x[2]) > abs(x[9]) + abs(x[10]) + abs(x[11]);
    const P two = select(high, x[0], x[9]), one = select(high, x[1], x[10]), none = select(high, x[2], x[11]);
    const Mask<W> big = abs(two) > abs(none);
    v[E] = from_half(e.prismatic[E], select(big, two, one), select(big, one, none));
  }
  {
    const Mask<W> high = abs(x[0]) + abs(x[9]) > abs(x[2]) + abs(x[11]);
    const P three = select(high, x[0], x[2]), two = select(high, x[3], x[5]), one = select(high, x[6], x[8]),
            none = select(high, x[9], x[11]);
    const Mask<W> big = abs(three) > abs(none);
    v[D] = from_half(e.prismatic[D], select(big, three, one), select(big, two, none));
  }
  // S_b J_c S_c J_d S_d J_e S_e
  Frame<P> right = constant_frame<P>(link_at(B));
  const int places[3] = {C, D, E};
  for (int place : places) {
    right = times(right, joint_motion(e.prismatic[place], e.bend, v[place]));
    right = compose(right, link_at(place));
  }
  P f[INVARIANTS], product[8];
  invariants(Line<P>{right.p, right.z}, f);
  for (int r = 0; r < 8; ++r) {
    P sum(-e.recover_constant[r]);
    for (int k = 0; k < INVARIANTS; ++k) sum = P(e.recover[r][k]) * f[k] + sum;
    product[r] = sum;
  }
  // the products are (a0 b0, a0 b1, a0, a1 b0, a1 b1, a1, b0, b1)
  v[A] = e.prismatic[A] ? product[5] : atan2(product[5], product[2]);
  v[B] = e.prismatic[B] ? product[7] : atan2(product[7], product[6]);
  // J_f = (S_f J_a S_a J_b right)^-1
  Frame<P> left = compose(joint_motion(e.prismatic[A], e.bend, v[A]), e.link[A]);
  left = compose(e.link[F], left);
  left = times(times(left, joint_motion(e.prismatic[B], e.bend, v[B])), right);
  v[F] = e.prismatic[F] ? -left.p.z : -atan2(left.x.y, left.x.x);
}

// One damped Newton step on the true chain towards `target`, lengths in units of `size`. Returns the
// squared error before the step; `pivot` is the smallest of J J^T.
template <int W>
KINVERSE_INLINE Pack<W> newton_step(const Chain& chain, double size, const Frame<Pack<W>>& target, Pack<W>* q,
                                    Pack<W>& pivot) {
  using P = Pack<W>;
  P J[6][6], e[6];
  const Frame<P> reached = forward<W>(chain, q, J);
  const P unit(1.0 / size);
  const Vec3<P> dp = scaled(unit, target.p - reached.p), m = rotation_moment(target, reached);
  const P trace = dot(target.x, reached.x) + dot(target.y, reached.y) + dot(target.z, reached.z);
  // 2 sin(angle / 2) along the axis
  const P stretch = P(2.0) / sqrt(max(trace + P(1.0), P(1e-4)));
  e[0] = dp.x, e[1] = dp.y, e[2] = dp.z;
  e[3] = m.x * stretch, e[4] = m.y * stretch, e[5] = m.z * stretch;
  P error(0.0);
  for (int k = 0; k < 6; ++k) error = e[k] * e[k] + error;
  for (int i = 0; i < 6; ++i) {
    P* column = J[chain.source[i]];
    const P length(chain.prismatic[i] ? size : 1.0);  // slides are measured in sizes too
    for (int k = 0; k < 3; ++k) column[k] = P(column[k] * unit) * length;
    for (int k = 3; k < 6; ++k) column[k] = column[k] * length;
  }
  const P mu = P(1e-3) * error + P(1e-16);
  P H[6][6], D[6];
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c <= r; ++c) {
      P sum = r == c ? mu : P(0.0);
      for (int j = 0; j < 6; ++j) sum = J[j][r] * J[j][c] + sum;
      H[r][c] = sum;
    }
  }
  pivot = P(1e300);
  for (int j = 0; j < 6; ++j) {
    P L[6], d = H[j][j];
    for (int k = 0; k < j; ++k) {
      L[k] = H[j][k] * D[k];
      d = d - H[j][k] * L[k];
    }
    pivot = min(pivot, d);
    D[j] = P(1.0) / max(d, P(1e-17));
    for (int i = j + 1; i < 6; ++i) {
      P t = H[i][j];
      for (int k = 0; k < j; ++k) t = t - H[i][k] * L[k];
      H[i][j] = t;
    }
  }
  // H holds L D below the diagonal
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < i; ++k) e[i] = e[i] - H[i][k] * e[k];
    e[i] = e[i] * D[i];
  }
  for (int i = 5; i >= 0; --i) {
    P t(0.0);
    for (int k = i + 1; k < 6; ++k) t = H[k][i] * e[k] + t;
    e[i] = e[i] - D[i] * t;
  }
  for (int i = 0; i < 6; ++i) {
    const int j = chain.source[i];
    P step(0.0);
    for (int k = 0; k < 6; ++k) step = J[j][k] * e[k] + step;
    q[j] = step * P(chain.prismatic[i] ? size : 1.0) + q[j];
  }
  return error;
}

constexpr int MOST_STEPS = 30, SEARCH_STEPS = 40;
constexpr double SINGULAR_PIVOT = 1e-12;  // of J J^T in units of the arm's size

// Newton steps, then winding, limits and errors; stored from lane `first` of the block on.
template <int W>
KINVERSE_INLINE void polish(const Chain& chain, double size, int most_steps, const Tolerances& tolerances,
                            const Frame<Pack<W>>& target, const double* reference, Pack<W>* q, RootBlock& block,
                            int first, int count) {
  using P = Pack<W>;
  // At a double root the error falls by 16 a step and no faster, and roots come apart only in the last
  // digits: go on as long as some root gains.
  P pivot, last(1e300);
  for (int step = 0; step < most_steps; ++step) {
    const P error = newton_step<W>(chain, size, target, q, pivot);
    const P wanted = step < 12 ? P(1e300) : P(0.5) * last;
    if (!any((error > P(1e-27)) & (error < P(100.0)) & (error < wanted))) break;
    last = error;
  }
  for (int i = 0; i < 6; ++i) {
    const int j = chain.source[i];
    if (!chain.prismatic[i])
      q[j] = wind(q[j], P(reference[j]), P(chain.lower[j]), P(chain.upper[j]), tolerances.hold_limits);
  }
  const Checked<W> checked = check(chain, Task::pose, target, q, tolerances.position, tolerances.rotation);
  for (int j = 0; j < 6; ++j) store(block.value[j] + first, q[j]);
  store(block.value[6] + first, checked.position_error);
  store(block.value[7] + first, checked.rotation_error);
  const unsigned used = count - first < W ? (1u << (count - first)) - 1u : ~0u;
  const Mask<W> exact = (checked.position_error <= P(tolerances.exact_position)) &
                        (checked.rotation_error <= P(tolerances.exact_rotation));
  block.exact |= (lane_bits(exact) & used) << first;
  block.verified |= (lane_bits(checked.verified) & used) << first;
  block.inside |= (lane_bits(checked.inside) & used) << first;
  block.singular |= (lane_bits(pivot < P(SINGULAR_PIVOT)) & used) << first;
}

// Roots that are not farther off the unit circle than this are tried.
constexpr double NEAR_CIRCLE = 0.06, NEAR_CIRCLE_DISTURBED = 0.2;
// Squared: how far off it roots are watched for their accuracy.
constexpr double WATCHED = 0.6;
// A root this near is taken as real in the count.
constexpr double ON_CIRCLE = 1e-5;
constexpr double FAR_SLIDE = 1e-2;
// A real root that polishing takes farther than this has ended at another solution.
constexpr double STRAYED = 1e-2;

inline void general_6r_pose(const Chain& chain, const General6R& arm, int which, const Tolerances& tolerances,
                            const double* T, const double* reference, RootBlock& block) {
  constexpr int W = LANES;
  using P = Pack<W>;
  const Elimination& e = arm.elimination[which];
  double link[12];
  pose_link(e, arm.size, T, link);
  Equations six;
  equations<W>(e, link, six);
  const TrigPolynomial f = characteristic<W>(six, *arm.tables, block.noise);
  double re[TRIG_ROOTS], im[TRIG_ROOTS];
  trig_roots<W>(f, re, im);

  // candidates by angle
  int count = 0;
  block.real = block.complex = block.strayed = 0;
  block.off_circle = 1e300;
  double reals[TRIG_ROOTS];
  bool is_real[TRIG_ROOTS];
  for (int k = 0; k < TRIG_ROOTS; ++k) {
    alignas(64) double one[1];
    const double r2 = re[k] * re[k] + im[k] * im[k];
    const double off = 0.5 * (r2 - 1.0) / (r2 > 1.0 ? r2 : 1.0);  // log |z| near the circle
    const double distance = __builtin_fabs(off);
    store(one, atan2(Pack<1>(im[k]), Pack<1>(re[k])));
    const bool real = distance < ON_CIRCLE;
    if (real) reals[block.real++] = one[0];
    block.complex += !real;
    if (!real && distance < block.off_circle) block.off_circle = distance;
    if (distance > (e.disturbance > 0.0 ? NEAR_CIRCLE_DISTURBED : NEAR_CIRCLE)) continue;
    // a pair beside the circle may be two real roots that the rounding pushed off it: try both sides
    const double angle = one[0] + (real ? 0.0 : off);
    int at = count++;
    for (; at > 0 && block.angle[at - 1] > angle; --at) {
      block.angle[at] = block.angle[at - 1];
      is_real[at] = is_real[at - 1];
    }
    block.angle[at] = angle;
    is_real[at] = real;
  }
  block.candidates = count;
  // Roots come in pairs (z, 1 / conj z); a real one is its own partner. How badly the computed ones
  // match tells how well they are known.
  block.blur = 0.0;
  for (int k = 0; k < TRIG_ROOTS; ++k) {
    const double r2 = re[k] * re[k] + im[k] * im[k];
    if (!(r2 > WATCHED && r2 < 1.0 / WATCHED)) continue;
    double nearest = 1e300;
    for (int j = 0; j < TRIG_ROOTS; ++j) {
      const double dx = re[j] - re[k] / r2, dy = im[j] - im[k] / r2, d = dx * dx + dy * dy;
      nearest = d < nearest ? d : nearest;
    }
    block.blur = nearest > block.blur ? nearest : block.blur;
  }
  block.blur = __builtin_sqrt(block.blur);
  block.gap = TWO_PI;
  for (int i = 0; i < block.real; ++i)
    for (int j = 0; j < i; ++j) {
      double d = __builtin_fabs(reals[i] - reals[j]);
      d = d > PI ? TWO_PI - d : d;
      block.gap = d < block.gap ? d : block.gap;
    }

  block.exact = block.verified = block.inside = block.singular = 0;
  const Frame<P> target = constant_frame<P>(T);
  for (int first = 0; first < count; first += W) {
    alignas(64) double angle[W];
    for (int l = 0; l < W; ++l) angle[l] = block.angle[first + l < count ? first + l : count - 1];
    P v[6], q[6];
    back_substitute(e, link, six, load<W>(angle), v);
    // a slide so far out that its bend counts is no root of this arm
    Mask<W> far = Mask<W>::all(false);
    for (int place = 0; place < 6; ++place)
      if (e.prismatic[place]) far = far | !(abs(v[place]) < P(FAR_SLIDE / e.bend));
    const unsigned far_lanes = lane_bits(far);
    for (int l = 0; l < W && first + l < count; ++l)
      if (is_real[first + l] && (far_lanes >> l & 1u)) --block.real;
    for (int place = 0; place < 6; ++place) {
      const int i = e.joint[place];
      P value = P(e.sign) * (v[place] - P(e.shift[place]));
      if (chain.prismatic[i]) value = value * P(arm.size);
      q[chain.source[i]] = (value - P(chain.offset[i])) * P(1.0 / chain.multiplier[i]);
    }
    polish<W>(chain, arm.size, MOST_STEPS, tolerances, target, reference, q, block, first, count);
    for (int l = 0; l < W && first + l < count; ++l) {
      if (!is_real[first + l] || (far_lanes >> l & 1u)) continue;
      const int i = e.joint[C];
      const double held = chain.multiplier[i] * block.value[chain.source[i]][first + l] + chain.offset[i];
      double moved = e.sign * held - angle[l];
      moved -= TWO_PI * __builtin_rint(moved * (1.0 / TWO_PI));
      if (__builtin_fabs(moved) > STRAYED) ++block.strayed;
    }
  }
}

// Up to 16 starts q (count, 6) instead of roots: what a search that can only add is made of.
inline void general_6r_polish(const Chain& chain, double size, const Tolerances& tolerances, const double* T,
                              const double* reference, const double* starts, int count, RootBlock& block) {
  constexpr int W = LANES;
  using P = Pack<W>;
  block.exact = block.verified = block.inside = block.singular = 0;
  block.candidates = count;
  const Frame<P> target = constant_frame<P>(T);
  for (int first = 0; first < count; first += W) {
    P q[6];
    for (int j = 0; j < 6; ++j) {
      alignas(64) double t[W];
      for (int l = 0; l < W; ++l) t[l] = starts[6 * (first + l < count ? first + l : count - 1) + j];
      q[j] = load<W>(t);
    }
    polish<W>(chain, size, SEARCH_STEPS, tolerances, target, reference, q, block, first, count);
  }
}

}  // namespace kinverse::KINVERSE_ISA
