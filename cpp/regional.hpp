// The regional structure of an arm: the first three joints, which place the wrist point. Pieper (1968)
// for the four ways in which two of their axes simplify.
#pragma once

#include "closed_form_spec.hpp"
#include "subproblems.hpp"

namespace kinverse::KINVERSE_ISA {

template <class P>
KINVERSE_INLINE Vec3<P> back_z(Vec3<P> v, Angle<P> t) {
  return turn_z(v, t.c, -t.s);
}
template <class P>
KINVERSE_INLINE Vec3<P> back_x(Vec3<P> v, const ClosedFormSpec& spec, int i) {
  return turn_x(v, P(spec.cos_alpha[i]), P(-spec.sin_alpha[i]));
}
// through joint i and its link's twist, towards the tool
template <class P>
KINVERSE_INLINE Vec3<P> past_joint(Vec3<P> v, const ClosedFormSpec& spec, int i, Angle<P> t) {
  return back_x(back_z(v, t), spec, i);
}

template <class P>
struct Shoulder {
  Angle<P> t[3];
  P theta[3];
  Vec3<P> w;  // the point where the second stage needs it
};

// Joint 1 when axes 2 and 3 (and 4) are parallel: the point keeps the distance `along` along them.
// Leaves w in frame 1.
template <class P, class Context>
KINVERSE_INLINE void solve_shoulder(const ClosedFormSpec& spec, Context& context, Vec3<P> w, double along, P sign,
                                    Shoulder<P>& arm) {
  const double sa = spec.sin_alpha[0], ca = spec.cos_alpha[0];
  P y = P(ca / sa) * w.z - P(along / sa);
  P rho;
  arm.t[0] = solve_linear(context, w.y, -w.x, y, sign, P(spec.size * spec.size), 0, rho);
  arm.theta[0] = context.angle(arm.t[0].s, arm.t[0].c);
  arm.w = {rho - P(spec.a[0]), P(ca) * y + P(sa) * w.z, P(along)};
}

// The point (a3, -d4 sin alpha3, d3 + d4 cos alpha3): the wrist in frame 2 while joint 3 stands at 0.
struct Forearm {
  double x, y, z;
};
KINVERSE_INLINE Forearm forearm(const ClosedFormSpec& spec) {
  return {spec.a[2], -spec.d[3] * spec.sin_alpha[2], spec.d[2] + spec.d[3] * spec.cos_alpha[2]};
}

template <class P, class Context>
KINVERSE_INLINE void place_first(const ClosedFormSpec& spec, Context& context, Vec3<P> w, P sign, Shoulder<P>& arm) {
  const Forearm f = forearm(spec);
  const double f2 = f.x * f.x + f.y * f.y + f.z * f.z;
  const double a1 = spec.a[0], a2 = spec.a[1], d2 = spec.d[1];
  const double c1 = spec.cos_alpha[0], s1 = spec.sin_alpha[0], c2 = spec.cos_alpha[1], s2 = spec.sin_alpha[1];
  const P size2(spec.size * spec.size);
  P root;
  switch (spec.regional) {
    case Regional::parallel_23:
      solve_shoulder(spec, context, w, d2 + f.z, sign, arm);
      break;
    case Regional::parallel_12:
      // the height over the shoulder plane depends on joint 3 alone
      arm.t[2] = solve_linear(context, P(s2 * f.y), P(s2 * f.x), w.z - P(d2 + c2 * f.z), sign, size2, 2, root);
      break;
    case Regional::intersecting_12: {
      // so does the distance from the point where axes 1 and 2 meet
      P k = (dot(w, w) - P(a2 * a2 + f2 + d2 * d2 + 2.0 * d2 * c2 * f.z)) * P(0.5);
      arm.t[2] = solve_linear(context, P(a2 * f.x + d2 * s2 * f.y), P(d2 * s2 * f.x - a2 * f.y), k, sign,
                              P(size2 * size2), 2, root);
      break;
    }
    case Regional::intersecting_23: {
      // the distance from the point where axes 2 and 3 meet depends on joint 1 alone:
      // |w - (a1, 0, 0) - d2 (axis 2)|^2 with axis 2 = (0, -s1, c1) seen from frame 0 turned by joint 1
      P k = (dot(w, w) + P(a1 * a1 + d2 * d2 - f2) - P(2.0 * d2 * c1) * w.z) * P(0.5);
      arm.t[0] = solve_linear(context, P(a1) * w.x - P(d2 * s1) * w.y, P(a1) * w.y + P(d2 * s1) * w.x, k, sign,
                              P(size2 * size2), 0, root);
      break;
    }
  }
  if (spec.regional == Regional::parallel_12 || spec.regional == Regional::intersecting_12) {
    arm.theta[2] = context.angle(arm.t[2].s, arm.t[2].c);
    // the wrist in frame 1 while joint 2 stands at 0
    Vec3<P> v = turn_z(Vec3<P>{P(f.x), P(f.y), P(f.z)}, arm.t[2].c, arm.t[2].s);
    v = turn_x(v, P(c2), P(s2));
    arm.w = {v.x + P(a2), v.y, v.z + P(d2)};
  } else if (spec.regional == Regional::intersecting_23) {
    arm.theta[0] = context.angle(arm.t[0].s, arm.t[0].c);
    Vec3<P> v = back_z(w, arm.t[0]);
    v = back_x(Vec3<P>{v.x - P(a1), v.y, v.z}, spec, 0);
    arm.w = {v.x, v.y, v.z - P(d2)};
  }
}

// Overwrites what the other sign left, and nothing that place_first found.
template <class P, class Context>
KINVERSE_INLINE void place_second(const ClosedFormSpec& spec, Context& context, Vec3<P> w, P sign, Shoulder<P>& arm) {
  const Forearm f = forearm(spec);
  const double c1 = spec.cos_alpha[0], s1 = spec.sin_alpha[0], c2 = spec.cos_alpha[1], s2 = spec.sin_alpha[1];
  const P size2(spec.size * spec.size);
  switch (spec.regional) {
    case Regional::parallel_23: {
      double reach = __builtin_sqrt(f.x * f.x + f.y * f.y);
      Angle<P> elbow;
      two_link(context, arm.w.x, arm.w.y, P(spec.a[1]), P(reach), sign, size2, 1, arm.t[1], elbow);
      // from the line elbow-wrist back to x of frame 3
      P cp(f.x / reach), sp(f.y / reach);
      arm.t[2] = {elbow.c * cp + elbow.s * sp, elbow.s * cp - elbow.c * sp};
      arm.theta[1] = context.angle(arm.t[1].s, arm.t[1].c);
      arm.theta[2] = context.angle(arm.t[2].s, arm.t[2].c);
      break;
    }
    case Regional::parallel_12: {
      P reach2 = squared(arm.w.x) + squared(arm.w.y);
      P reach = context.root(reach2, size2);
      Angle<P> elbow;
      two_link(context, w.x, w.y, P(spec.a[0]), reach, sign, size2, 0, arm.t[0], elbow);
      P ec = elbow.c * arm.w.x + elbow.s * arm.w.y, es = elbow.s * arm.w.x - elbow.c * arm.w.y;
      context.direction(ec, es, size2, 1);
      arm.t[1] = {ec, es};
      arm.theta[0] = context.angle(arm.t[0].s, arm.t[0].c);
      arm.theta[1] = context.angle(arm.t[1].s, arm.t[1].c);
      break;
    }
    case Regional::intersecting_12: {
      // height: s1 g_y + c1 g_z = w_z, where g = Rz(theta2) arm.w is the wrist in frame 1
      P gy = (w.z - P(c1) * arm.w.z) * P(1.0 / s1);
      P gx;
      arm.t[1] = solve_linear(context, arm.w.y, arm.w.x, gy, sign, size2, 1, gx);
      // solve_linear's root is  a sin t - b cos t = -g_x
      P x = -gx, y = P(c1) * gy - P(s1) * arm.w.z;
      P fc = w.x * x + w.y * y, fs = w.y * x - w.x * y;
      context.direction(fc, fs, size2 * (squared(x) + squared(y)), 0);
      arm.t[0] = {fc, fs};
      arm.theta[0] = context.angle(arm.t[0].s, arm.t[0].c);
      arm.theta[1] = context.angle(arm.t[1].s, arm.t[1].c);
      break;
    }
    case Regional::intersecting_23: {
      // height along axis 2: s2 h_y + c2 h_z = w_z, where h = Rz(theta3) forearm
      P hy = (arm.w.z - P(c2 * f.z)) * P(1.0 / s2);
      P hx;
      arm.t[2] = solve_linear(context, P(f.y), P(f.x), hy, sign, size2, 2, hx);
      P x = -hx, y = P(c2) * hy - P(s2 * f.z);
      P fc = arm.w.x * x + arm.w.y * y, fs = arm.w.y * x - arm.w.x * y;
      context.direction(fc, fs, size2 * (squared(x) + squared(y)), 1);
      arm.t[1] = {fc, fs};
      arm.theta[1] = context.angle(arm.t[1].s, arm.t[1].c);
      arm.theta[2] = context.angle(arm.t[2].s, arm.t[2].c);
      break;
    }
  }
}

}  // namespace kinverse::KINVERSE_ISA
