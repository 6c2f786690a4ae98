// How far a pose is from its target, counting only what the task constrains: as two norms for the
// verification, and as rows with their derivatives for the least-squares iteration.
#pragma once

#include "chain.hpp"
#include "se3.hpp"

namespace kinverse::KINVERSE_ISA {

// sin(angle) * axis of the rotation that leads from b to a
template <class P>
KINVERSE_INLINE Vec3<P> rotation_moment(const Frame<P>& a, const Frame<P>& b) {
  auto m = cross(b.x, a.x) + (cross(b.y, a.y) + cross(b.z, a.z));
  return scaled(P(0.5), m);
}

// The axis of a turn close to pi, where the moment vanishes: the largest column of the symmetric part
// c I + (1 - c) u u^T of the rotation from b to a, with the sign of the moment. One lane at a time.
template <int W>
void half_turn_axis(const Frame<Pack<W>>& a, const Frame<Pack<W>>& b, Vec3<Pack<W>>& axis, unsigned lanes) {
  using P = Pack<W>;
  const Vec3<P> from[3] = {b.x, b.y, b.z}, to[3] = {a.x, a.y, a.z};
  Vec3<P> moment = rotation_moment(a, b);
  for (int l = 0; l < W; ++l) {
    if (!(lanes >> l & 1u)) continue;
    double e[3][3];
    auto at = [l](const Vec3<P>& v, int k) { return k == 0 ? v.x[l] : k == 1 ? v.y[l] : v.z[l]; };
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) e[i][j] = at(to[0], i) * at(from[0], j) + at(to[1], i) * at(from[1], j) + at(to[2], i) * at(from[2], j);
    double c = 0.5 * (e[0][0] + e[1][1] + e[2][2] - 1.0);
    int k = e[0][0] >= e[1][1] && e[0][0] >= e[2][2] ? 0 : e[1][1] >= e[2][2] ? 1 : 2;
    double u[3], norm2 = 0.0, side = 0.0;
    for (int i = 0; i < 3; ++i) {
      u[i] = 0.5 * (e[i][k] + e[k][i]) - (i == k ? c : 0.0);
      norm2 += u[i] * u[i];
      side += u[i] * at(moment, i);
    }
    double scale = (side < 0.0 ? -1.0 : 1.0) / __builtin_sqrt(norm2);
    axis.x = set_lane(axis.x, l, u[0] * scale);
    axis.y = set_lane(axis.y, l, u[1] * scale);
    axis.z = set_lane(axis.z, l, u[2] * scale);
  }
}

// sine and cosine of half the angle between two rotations
template <class P>
struct HalfAngle {
  P sine, cosine;
};
template <class P>
KINVERSE_INLINE HalfAngle<P> half_angle(const Frame<P>& a, const Frame<P>& b) {
  Vec3<P> dx = a.x - b.x, dy = a.y - b.y, dz = a.z - b.z;
  P sine2 = (dot(dx, dx) + dot(dy, dy) + dot(dz, dz)) * P(0.125);
  return {sqrt(min(sine2, P(1.0))), sqrt(max(P(1.0) - sine2, P(0.0)))};
}

// Below this cosine of half the angle the axis no longer comes from the moment.
constexpr double HALF_TURN = 1e-4;

// log(R_a R_b^T) in the base frame, and its length
template <int W>
KINVERSE_INLINE Vec3<Pack<W>> rotation_log(const Frame<Pack<W>>& a, const Frame<Pack<W>>& b, Pack<W>& angle) {
  using P = Pack<W>;
  HalfAngle<P> half = half_angle(a, b);
  Vec3<P> moment = rotation_moment(a, b);
  P sine = length(moment);
  angle = atan2(sine, P(1.0) - P(2.0) * P(half.sine * half.sine));
  // 1 where the angle is so small that it and its sine cannot be told apart
  P factor = select(sine > P(1e-12), angle / max(sine, P(1e-300)), P(1.0));
  factor = select((sine <= P(1e-12)) & (half.sine > P(0.5)), P(0.0), factor);
  Vec3<P> log = scaled(factor, moment);
  unsigned turned = lane_bits(half.cosine < P(HALF_TURN));
  if (__builtin_expect(turned != 0, 0)) {
    Vec3<P> axis{P(0.0), P(0.0), P(0.0)};
    half_turn_axis<W>(a, b, axis, turned);
    Mask<W> there = lane_mask<W>(turned);
    log = {select(there, P(angle * axis.x), log.x), select(there, P(angle * axis.y), log.y),
           select(there, P(angle * axis.z), log.z)};
  }
  return log;
}

// Angle between two unit vectors by their chord, exact for small angles.
template <class P>
KINVERSE_INLINE P direction_distance(Vec3<P> a, Vec3<P> b) {
  Vec3<P> d = a - b;
  P sine2 = dot(d, d) * P(0.25);
  return P(2.0) * atan2(sqrt(min(sine2, P(1.0))), sqrt(max(P(1.0) - sine2, P(0.0))));
}

// Norms [m, rad] of the components that the task constrains.
template <int W>
KINVERSE_INLINE void task_errors(Task task, const Frame<Pack<W>>& target, const Frame<Pack<W>>& reached,
                                 Pack<W>& position_error, Pack<W>& rotation_error) {
  using P = Pack<W>;
  Vec3<P> d = target.p - reached.p;
  if (task == Task::planar) d.z = P(0.0);
  position_error = length(d);
  if (task == Task::pose) {
    rotation_error = rotation_distance(target, reached);
  } else if (task == Task::position) {
    rotation_error = P(0.0);
  } else if (task == Task::position_axis) {
    rotation_error = direction_distance(target.z, reached.z);
  } else {
    P angle;
    rotation_error = abs(rotation_log<W>(target, reached, angle).z);
  }
}

}  // namespace kinverse::KINVERSE_ISA
