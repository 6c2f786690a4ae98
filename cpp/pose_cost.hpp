// What a population method minimises: position error + weight * orientation error (document 004,
// equations 6.25 to 6.34), one configuration per lane.
#pragma once

#include "task_error.hpp"

namespace kinverse::KINVERSE_ISA {

template <class P>
KINVERSE_INLINE P norm_of(Norm norm, Vec3<P> v) {
  if (norm == Norm::l1) return abs(v.x) + abs(v.y) + abs(v.z);
  P square = dot(v, v);
  return norm == Norm::squared ? square : sqrt(square);
}

// roll, pitch, yaw of R = Rz(yaw) Ry(pitch) Rx(roll)
template <class P>
KINVERSE_INLINE Vec3<P> roll_pitch_yaw(const Frame<P>& f) {
  P level = sqrt(P(f.x.x * f.x.x + f.x.y * f.x.y));
  return {atan2(f.y.z, f.z.z), atan2(-f.x.z, level), atan2(f.x.y, f.x.x)};
}

// an angle of one turn at most to within half a turn
template <class P>
KINVERSE_INLINE P unwrapped(P angle) {
  angle = select(angle > P(PI), P(angle - P(TWO_PI)), angle);
  return select(angle < P(-PI), P(angle + P(TWO_PI)), angle);
}

template <int W>
KINVERSE_INLINE Pack<W> pose_cost(const CostSpec& spec, const Frame<Pack<W>>& target, const Frame<Pack<W>>& reached,
                                  Pack<W> weight) {
  using P = Pack<W>;
  Vec3<P> d = target.p - reached.p;
  if (spec.task == Task::planar) d.z = P(0.0);
  const P far = norm_of(spec.norm, d);
  if (spec.task == Task::position) return far;
  P turned;
  if (spec.orientation == Orientation::euler) {
    const Vec3<P> v = roll_pitch_yaw(target) - roll_pitch_yaw(reached);
    turned = norm_of(spec.norm, Vec3<P>{unwrapped(v.x), unwrapped(v.y), unwrapped(v.z)});
  } else if (spec.orientation == Orientation::rotation_vector) {
    P angle;
    turned = norm_of(spec.norm, rotation_log<W>(target, reached, angle));
  } else {
    P position;
    task_errors<W>(spec.task, target, reached, position, turned);
    if (spec.norm == Norm::squared) turned = turned * turned;
  }
  return weight * turned + far;
}

}  // namespace kinverse::KINVERSE_ISA
