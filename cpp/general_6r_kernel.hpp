// All solutions of a six-joint arm that no special family fits, one pose at a time: roots of the
// characteristic polynomial, from these all joints, polished on the true chain.
#pragma once

#include "newton.hpp"
#include "resultant.hpp"
#include "slide_pair.hpp"

namespace kinverse::KINVERSE_ISA {

// The motion of a joint with loop value v, as 12 packs.
template <class P>
KINVERSE_INLINE Frame<P> joint_motion(bool prismatic, P v) {
  const P zero(0.0), one(1.0);
  if (prismatic) return {{one, zero, zero}, {zero, one, zero}, {zero, zero, one}, {zero, zero, v}};
  P s, c;
  sincos(v, s, c);
  return {{c, s, zero}, {-s, c, zero}, {zero, zero, one}, {zero, zero, zero}};
}
template <class P>
KINVERSE_INLINE Frame<P> times(const Frame<P>& a, const Frame<P>& b) {
  auto turned = [&](const Vec3<P>& v) -> Vec3<P> {
    return {a.x.x * v.x + (a.y.x * v.y + a.z.x * v.z), a.x.y * v.x + (a.y.y * v.y + a.z.y * v.z),
            a.x.z * v.x + (a.y.z * v.y + a.z.z * v.z)};
  };
  return {turned(b.x), turned(b.y), turned(b.z), turned(b.p) + a.p};
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
    right = times(right, joint_motion(e.prismatic[place], v[place]));
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
  Frame<P> left = compose(joint_motion(e.prismatic[A], v[A]), e.link[A]);
  left = compose(e.link[F], left);
  left = times(times(left, joint_motion(e.prismatic[B], v[B])), right);
  v[F] = e.prismatic[F] ? -left.p.z : -atan2(left.x.y, left.x.x);
}

constexpr int MOST_STEPS = 30, SEARCH_STEPS = 40;

// Roots that are not farther off the unit circle than this are tried.
constexpr double NEAR_CIRCLE = 0.06, NEAR_CIRCLE_DISTURBED = 0.2;
// Squared: how far off it roots are watched for their accuracy.
constexpr double WATCHED = 0.6;
// A root this near is taken as real in the count.
constexpr double ON_CIRCLE = 1e-5;
// Squared sine of the angle between two slides below which they do not move apart.
constexpr double PARALLEL_SLIDES = 1e-12;
// A real root that polishing takes farther than this has ended at another solution.
constexpr double STRAYED = 1e-2;

// The angles of the roots on and near the unit circle, in order, and what all of them tell.
inline void sort_roots(const double* re, const double* im, double near_circle, RootBlock& block, bool* is_real) {
  int count = 0;
  block.real = block.complex = block.strayed = 0;
  block.off_circle = 1e300;
  double reals[TRIG_ROOTS];
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
    if (distance > near_circle) continue;
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
}

// From values on the loop to joint values, polished; a real root that ends elsewhere has strayed.
template <int W>
KINVERSE_INLINE void polish_roots(const Chain& chain, double size, const int* joint, double sign, const double* shift,
                                  int driver, const Tolerances& tolerances, const Frame<Pack<W>>& target,
                                  const double* reference, const Pack<W>* v, const bool* is_real, RootBlock& block,
                                  int first, int count) {
  using P = Pack<W>;
  P q[6];
  for (int place = 0; place < 6; ++place) {
    const int i = joint[place];
    P value = P(sign) * (v[place] - P(shift[place]));
    if (chain.prismatic[i]) value = value * P(size);
    q[chain.source[i]] = (value - P(chain.offset[i])) * P(1.0 / chain.multiplier[i]);
  }
  polish<W>(chain, size, MOST_STEPS, tolerances, target, reference, q, block, first, count);
  for (int l = 0; l < W && first + l < count; ++l) {
    if (!is_real[first + l]) continue;
    const int i = joint[driver];
    const double held = chain.multiplier[i] * block.value[chain.source[i]][first + l] + chain.offset[i];
    double moved = sign * held + shift[driver] - block.angle[first + l];
    moved -= TWO_PI * __builtin_rint(moved * (1.0 / TWO_PI));
    if (__builtin_fabs(moved) > STRAYED) ++block.strayed;
  }
}

template <int W>
KINVERSE_INLINE Pack<W> angles_from(const RootBlock& block, int first, int count) {
  alignas(64) double angle[W];
  for (int l = 0; l < W; ++l) angle[l] = block.angle[first + l < count ? first + l : count - 1];
  return load<W>(angle);
}

inline void slide_pair_pose(const Chain& chain, const General6R& arm, int which, const Tolerances& tolerances,
                            const double* T, const double* reference, RootBlock& block) {
  constexpr int W = LANES;
  using P = Pack<W>;
  constexpr double SHIFT[6] = {};
  const SlidePair& pair = arm.pair[which];
  const SlideLoop loop = slide_loop(pair, arm.size, T);
  double largest, re[TRIG_ROOTS], im[TRIG_ROOTS];
  trig_roots<W>(characteristic<W>(loop, *arm.tables, block.noise, largest), re, im);
  bool is_real[MAX_ROOTS];
  sort_roots(re, im, NEAR_CIRCLE, block, is_real);
  block.exact = block.verified = block.inside = block.singular = 0;
  const Frame<P> target = constant_frame<P>(T);
  int count = block.candidates, others = 0;
  double other[MAX_ROOTS];
  auto solve = [&](int from, int until, bool is_other) {
    for (int first = from; first < until; first += W) {
      P v[6], apart;
      Mask<W> both;
      close_loop<W>(loop, largest, angles_from<W>(block, first, until), Mask<W>::all(is_other), v, both, apart);
      const unsigned beside = lane_bits(both), parallel = lane_bits(apart < P(PARALLEL_SLIDES));
      for (int l = 0; l < W && first + l < until; ++l) {
        // slides side by side close the determinant, not the loop: no more a solution than a complex root
        if (is_real[first + l] && (parallel >> l & 1u)) --block.real, ++block.complex, is_real[first + l] = false;
        if (!is_other && (beside >> l & 1u)) other[others++] = block.angle[first + l];
      }
      polish_roots<W>(chain, arm.size, pair.joint, 1.0, SHIFT, loop.place[0], tolerances, target, reference, v, is_real,
                      block, first, until);
    }
  };
  solve(0, count, false);
  // the other way of the four-bar, where both may be roots; in packs of their own
  count = (count + W - 1) / W * W;
  if (!others || count == MAX_ROOTS) return;
  others = others < MAX_ROOTS - count ? others : MAX_ROOTS - count;
  for (int k = 0; k < others; ++k) {
    block.angle[count + k] = other[k];
    is_real[count + k] = false;
  }
  block.candidates = count + others;
  solve(count, count + others, true);
}

inline void general_6r_pose(const Chain& chain, const General6R& arm, int which, const Tolerances& tolerances,
                            const double* T, const double* reference, RootBlock& block) {
  constexpr int W = LANES;
  using P = Pack<W>;
  if (arm.pair) return slide_pair_pose(chain, arm, which, tolerances, T, reference, block);
  const Elimination& e = arm.elimination[which];
  double link[12];
  pose_link(e, arm.size, T, link);
  Equations six;
  equations<W>(e, link, six);
  double re[TRIG_ROOTS], im[TRIG_ROOTS];
  trig_roots<W>(characteristic<W>(six, *arm.tables, block.noise), re, im);
  bool is_real[TRIG_ROOTS];
  sort_roots(re, im, e.disturbance > 0.0 ? NEAR_CIRCLE_DISTURBED : NEAR_CIRCLE, block, is_real);
  block.exact = block.verified = block.inside = block.singular = 0;
  const Frame<P> target = constant_frame<P>(T);
  const int count = block.candidates;
  for (int first = 0; first < count; first += W) {
    P v[6];
    back_substitute<W>(e, link, six, angles_from<W>(block, first, count), v);
    polish_roots<W>(chain, arm.size, e.joint, e.sign, e.shift, C, tolerances, target, reference, v, is_real, block, first,
                    count);
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
    gather_joints<W>(starts, 6, first, count, q);
    polish<W>(chain, size, SEARCH_STEPS, tolerances, target, reference, q, block, first, count);
  }
}

}  // namespace kinverse::KINVERSE_ISA
