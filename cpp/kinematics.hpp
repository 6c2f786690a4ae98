// Forward kinematics and the geometric Jacobian of a chain, one configuration per lane.
#pragma once

#include "chain.hpp"
#include "se3.hpp"

namespace kinverse::KINVERSE_ISA {

// Rows of joint values, lane l from configuration first + l; the tail repeats the last one, so that
// every configuration goes through the same instructions.
template <int W>
KINVERSE_INLINE void gather_joints(const double* q, int dof, long first, long count, Pack<W>* out) {
  const double* rows[W];
  for (int l = 0; l < W; ++l) rows[l] = q + (first + l < count ? first + l : count - 1) * dof;
  gather_rows<W>(rows, dof, out);
}

template <int W>
KINVERSE_INLINE Frame<Pack<W>> move_joint(const Frame<Pack<W>>& f, Pack<W> value, bool prismatic) {
  using P = Pack<W>;
  if (prismatic) return {f.x, f.y, f.z, {value * f.z.x + f.p.x, value * f.z.y + f.p.y, value * f.z.z + f.p.z}};
  P s, c;
  sincos(value, s, c);
  auto turned = [&](P a, P b, P k, P l) { return a * k + b * l; };
  return {{turned(f.x.x, f.y.x, c, s), turned(f.x.y, f.y.y, c, s), turned(f.x.z, f.y.z, c, s)},
          {f.y.x * c - f.x.x * s, f.y.y * c - f.x.y * s, f.y.z * c - f.x.z * s},
          f.z,
          f.p};
}

template <int W>
KINVERSE_INLINE Pack<W> joint_value(const Chain& chain, const Pack<W>* q, int joint) {
  return Pack<W>(chain.multiplier[joint]) * q[chain.source[joint]] + Pack<W>(chain.offset[joint]);
}

// T_base_tool
template <int W>
KINVERSE_INLINE Frame<Pack<W>> forward(const Chain& chain, const Pack<W>* q) {
  Frame<Pack<W>> f = constant_frame<Pack<W>>(chain.frames);
  for (int i = 0; i < chain.joints; ++i) {
    if (i) f = compose(f, chain.frames + 12 * i);
    f = move_joint(f, joint_value(chain, q, i), chain.prismatic[i]);
  }
  return compose(f, chain.frames + 12 * chain.joints);
}

// T_base_tool and the Jacobian J[6][dof], rows [linear; angular] in the base frame at the tool point.
template <int W>
KINVERSE_INLINE Frame<Pack<W>> forward(const Chain& chain, const Pack<W>* q, Pack<W> (*J)[6]) {
  using P = Pack<W>;
  Vec3<P> axis[MAX_JOINTS], origin[MAX_JOINTS];
  Frame<P> f = constant_frame<P>(chain.frames);
  for (int i = 0; i < chain.joints; ++i) {
    if (i) f = compose(f, chain.frames + 12 * i);
    axis[i] = f.z;
    origin[i] = f.p;
    f = move_joint(f, joint_value(chain, q, i), chain.prismatic[i]);
  }
  f = compose(f, chain.frames + 12 * chain.joints);
  for (int j = 0; j < chain.dof; ++j)
    for (int k = 0; k < 6; ++k) J[j][k] = P(0.0);
  for (int i = 0; i < chain.joints; ++i) {
    P rate(chain.multiplier[i]);
    P* column = J[chain.source[i]];
    if (chain.prismatic[i]) {
      column[0] = rate * axis[i].x + column[0];
      column[1] = rate * axis[i].y + column[1];
      column[2] = rate * axis[i].z + column[2];
    } else {
      Vec3<P> v = cross(axis[i], f.p - origin[i]);
      column[0] = rate * v.x + column[0];
      column[1] = rate * v.y + column[1];
      column[2] = rate * v.z + column[2];
      column[3] = rate * axis[i].x + column[3];
      column[4] = rate * axis[i].y + column[4];
      column[5] = rate * axis[i].z + column[5];
    }
  }
  return f;
}

}  // namespace kinverse::KINVERSE_ISA
