// The residual of a task and its derivative by the joints, one configuration per lane: what the
// least-squares iteration sees of an arm.
#pragma once

#include "least_squares_problem.hpp"
#include "task_error.hpp"

namespace kinverse::KINVERSE_ISA {

constexpr int rows_of(Task task) {
  return task == Task::pose || task == Task::position_axis ? 6 : task == Task::schoenflies ? 4 : 3;
}

// A point of the iteration: residual, its derivative by the joints, and its squared parts.
template <int W, int ROWS, int SIZE>
struct Point {
  Pack<W> e[ROWS], J[SIZE][ROWS], position2, rotation2;
};

template <int W, Task TASK, int N>
struct Evaluator {
  using P = Pack<W>;
  static constexpr int ROWS = rows_of(TASK), SIZE = N ? N : MAX_JOINTS;
  using PointT = Point<W, ROWS, SIZE>;
  const LeastSquaresProblem& problem;

  KINVERSE_INLINE int joints() const { return N ? N : problem.joints; }
  KINVERSE_INLINE int dof() const { return N ? N : problem.dof; }

  KINVERSE_INLINE void advance(Frame<P>& f, const Link& link) const {
    P a(link.shift[0]), b(link.shift[1]), c(link.shift[2]), k(link.cosine), s(link.sine);
    f.p = {a * f.x.x + (b * f.y.x + (c * f.z.x + f.p.x)), a * f.x.y + (b * f.y.y + (c * f.z.y + f.p.y)),
           a * f.x.z + (b * f.y.z + (c * f.z.z + f.p.z))};
    Vec3<P> y = f.y, z = f.z;
    f.y = {k * y.x + s * z.x, k * y.y + s * z.y, k * y.z + s * z.z};
    f.z = {k * z.x - s * y.x, k * z.y - s * y.y, k * z.z - s * y.z};
  }
  static KINVERSE_INLINE void turn(Frame<P>& f, P c, P s) {
    Vec3<P> x = f.x, y = f.y;
    f.x = {c * x.x + s * y.x, c * x.y + s * y.y, c * x.z + s * y.z};
    f.y = {c * y.x - s * x.x, c * y.y - s * x.y, c * y.z - s * x.z};
  }

  // Go from `at` to q in the lanes that `accept` takes, judged by the new squared error.
  template <class Accept>
  KINVERSE_INLINE void operator()(const P* q, const Frame<P>& target, Accept accept, PointT& at) const {
    Vec3<P> axis[SIZE], origin[SIZE];
    Frame<P> f = constant_frame<P>(problem.base);
    for (int i = 0; i < joints(); ++i) {
      const Link& link = problem.links[i];
      if (i) advance(f, link);
      axis[i] = f.z;
      origin[i] = f.p;
      if constexpr (N) {
        P s, c;
        sincos(q[i] + P(link.offset), s, c);
        turn(f, c, s);
      } else {
        P value = P(link.multiplier) * q[link.source] + P(link.offset);
        if (link.prismatic) {
          f.p = {value * f.z.x + f.p.x, value * f.z.y + f.p.y, value * f.z.z + f.p.z};
          turn(f, P(link.turn_cosine), P(link.turn_sine));
        } else {
          P s, c;
          sincos(value, s, c);
          turn(f, c, s);
        }
      }
    }
    advance(f, problem.links[joints()]);
    P e[ROWS], position2, rotation2;
    residual(target, f, e, position2, rotation2);
    Vec3<P> row = log_row(target, f, e, rotation2);
    const Mask<W> taken = accept(position2 + rotation2);
    at.position2 = select(taken, position2, at.position2);
    at.rotation2 = select(taken, rotation2, at.rotation2);
    for (int k = 0; k < ROWS; ++k) at.e[k] = select(taken, e[k], at.e[k]);
    if constexpr (N) {
      for (int i = 0; i < N; ++i) {
        P column[ROWS];
        put(cross(axis[i], f.p - origin[i]), axis[i], f, row, column);
        for (int k = 0; k < ROWS; ++k) at.J[i][k] = select(taken, column[k], at.J[i][k]);
      }
    } else {
      P sums[SIZE][ROWS];
      for (int j = 0; j < dof(); ++j)
        for (int k = 0; k < ROWS; ++k) sums[j][k] = P(0.0);
      for (int i = 0; i < joints(); ++i) {
        const Link& link = problem.links[i];
        P column[ROWS];
        Vec3<P> still{P(0.0), P(0.0), P(0.0)};
        if (link.prismatic)
          put(axis[i], still, f, row, column);
        else
          put(cross(axis[i], f.p - origin[i]), axis[i], f, row, column);
        P rate(link.multiplier);
        for (int k = 0; k < ROWS; ++k) sums[link.source][k] = rate * column[k] + sums[link.source][k];
      }
      for (int j = 0; j < dof(); ++j)
        for (int k = 0; k < ROWS; ++k) at.J[j][k] = select(taken, sums[j][k], at.J[j][k]);
    }
  }

 private:
  // Rotation residual of a full pose: 2 sin(angle / 2) times the axis, which has a gradient up to a
  // half turn and no arc functions.
  static KINVERSE_INLINE void residual(const Frame<P>& target, const Frame<P>& f, P* e, P& position2, P& rotation2) {
    Vec3<P> d = target.p - f.p;
    e[0] = d.x;
    e[1] = d.y;
    if constexpr (TASK == Task::planar) {
      position2 = d.x * d.x + d.y * d.y;
    } else {
      e[2] = d.z;
      position2 = dot(d, d);
    }
    if constexpr (TASK == Task::pose) {
      P trace1 = P(1.0) + dot(target.x, f.x) + (dot(target.y, f.y) + dot(target.z, f.z));
      P factor = P(2.0) / sqrt(max(trace1, P(1e-30)));
      Vec3<P> r = scaled(factor, rotation_moment(target, f));
      unsigned turned = lane_bits(trace1 < P(4.0 * HALF_TURN * HALF_TURN));
      if (__builtin_expect(turned != 0, 0)) {
        Vec3<P> u{P(0.0), P(0.0), P(0.0)};
        half_turn_axis<W>(target, f, u, turned);
        Mask<W> there = lane_mask<W>(turned);
        r = {select(there, u.x + u.x, r.x), select(there, u.y + u.y, r.y), select(there, u.z + u.z, r.z)};
      }
      e[3] = r.x;
      e[4] = r.y;
      e[5] = r.z;
      rotation2 = dot(r, r);
    } else if constexpr (TASK == Task::position) {
      rotation2 = P(0.0);
    } else if constexpr (TASK == Task::position_axis) {
      Vec3<P> r = target.z - f.z;
      e[3] = r.x;
      e[4] = r.y;
      e[5] = r.z;
      rotation2 = dot(r, r);
    }
  }

  // Planar and Schoenflies tasks: the z component of log(R_target R^T), and its derivative, the z row
  // of the inverse right Jacobian of SO(3) (Chirikjian 2012, eq. 10.86).
  static KINVERSE_INLINE Vec3<P> log_row(const Frame<P>& target, const Frame<P>& f, P* e, P& rotation2) {
    Vec3<P> row{P(0.0), P(0.0), P(0.0)};
    if constexpr (TASK == Task::planar || TASK == Task::schoenflies) {
      P angle;
      Vec3<P> log = rotation_log<W>(target, f, angle);
      P angle2 = angle * angle;
      HalfAngle<P> half = half_angle(target, f);
      P exact = (P(1.0) - P(0.5) * angle * half.cosine / max(half.sine, P(1e-3))) / max(angle2, P(1e-6));
      P series = P(1.0 / 12.0) + angle2 * (P(1.0 / 720.0) + angle2 * P(1.0 / 30240.0));
      P k = select(angle2 < P(1e-2), series, exact);
      row = {k * log.z * log.x - P(0.5) * log.y, k * log.z * log.y + P(0.5) * log.x,
             P(1.0) + k * (log.z * log.z - angle2)};
      e[ROWS - 1] = log.z;
      rotation2 = log.z * log.z;
    }
    return row;
  }

  // One column of the derivative from a joint's linear and angular velocity of the tool.
  static KINVERSE_INLINE void put(Vec3<P> linear, Vec3<P> angular, const Frame<P>& f, Vec3<P> row, P* column) {
    column[0] = linear.x;
    column[1] = linear.y;
    if constexpr (TASK != Task::planar) column[2] = linear.z;
    if constexpr (TASK == Task::pose) {
      column[3] = angular.x;
      column[4] = angular.y;
      column[5] = angular.z;
    } else if constexpr (TASK == Task::position_axis) {
      Vec3<P> v = cross(angular, f.z);
      column[3] = v.x;
      column[4] = v.y;
      column[5] = v.z;
    } else if constexpr (TASK == Task::planar || TASK == Task::schoenflies) {
      column[ROWS - 1] = dot(row, angular);
    }
  }
};

}  // namespace kinverse::KINVERSE_ISA
