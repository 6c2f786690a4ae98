// What the closed form of an arm needs to know: found once per arm by Python (solvers/closed_form/families.py).
#pragma once

namespace kinverse {

// Which equations solve the arm.
enum class Family : int {
  spherical_wrist,       // 6R, the axes of joints 4, 5, 6 meet in one point
  three_parallel,        // 6R, axes 2, 3, 4 parallel, axes 5 and 6 meet
  two_axis_wrist,        // 5R, axes 4 and 5 meet
  three_parallel_short,  // 5R, axes 2, 3, 4 parallel
  scara,                 // three parallel revolute joints, with or without a slide along them
};

// How the first three joints place the wrist.
enum class Regional : int { parallel_23, parallel_12, intersecting_12, intersecting_23 };

// The arm as  base * prod_i [Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i)] * tool  in the standard
// convention, with d of the first and the whole last row (but theta) absorbed by base and tool;
// joint[i] of the robot stands at sign[i] * (theta_i - offset[i]). A reversed arm is solved from its
// tool: T is inverted first.
struct ClosedFormSpec {
  Family family;
  Regional regional;
  bool reversed;
  bool perpendicular_wrist;
  int dof;
  int branches;
  double size;  // sum of the lengths: what "close to zero" is measured against
  double a[7], d[7], alpha[7], cos_alpha[7], sin_alpha[7];
  double base_inverse[12], tool_inverse[12];
  int joint[7];
  double sign[7], offset[7];
  // most that this form's forward kinematics differs from the chain's [m, rad]
  double position_deviation, rotation_deviation;
};

constexpr int MAX_BRANCHES = 8;

// What parametrises the solutions of an arm with seven joints.
enum class FreeParameter : int { first_joint, last_joint, arm_angle };

// Seven revolute joints, one degree of freedom too many. With an end joint held, what remains is an arm
// of six joints that does not depend on the value: only its target does. With the arm angle held (axes
// 1, 2, 3 meet, axes 5, 6, 7 meet) `form` has seven rows, read as a shoulder, an elbow and a hand.
struct RedundantSpec {
  ClosedFormSpec form;
  FreeParameter parameter;
  // end joint: inverses of the fixed transforms before and behind it, its multiplier is 1
  double before_inverse[12], behind_inverse[12];
  // arm angle: whether the shoulder's axes stand at right angles, and the side the elbow is on
  bool perpendicular_shoulder;
  double elbow_side;
  // the values the parameter may take; round: its ends are one value
  double low, high;
  bool round;
};

}  // namespace kinverse
