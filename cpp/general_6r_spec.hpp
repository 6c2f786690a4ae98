// What the elimination for a general six-joint arm needs to know: found once per arm (general_6r_setup.cpp).
#pragma once

#include "slide_pair_spec.hpp"

namespace kinverse {

// The arm and the pose close a loop of six joints and six links,
//   J_f S_f J_a S_a J_b S_b J_c S_c J_d S_d J_e S_e = 1,
// walked in either direction from any joint, so that any joint can be the one (c) in which the final
// polynomial is written. f drops out because its own axis does not move under it; a and b are removed
// by an orthogonal transformation that does not depend on the pose; d and e by the resultant.
enum Place : int { F, A, B, C, D, E };

constexpr int MAX_ROOTS = 16;
constexpr int INVARIANTS = 14;
constexpr int SAMPLES = 27;         // of three joints with three values each
constexpr int PADDED_SAMPLES = 32;  // to whole packs

// Lengths are in units of the arm's size; links are 3x4 blocks.
struct Elimination {
  int joint[6];       // which moving joint of the chain stands at each place
  bool prismatic[6];
  double sign;        // -1: the loop is walked backwards, joint values change sign
  double shift[6];    // the loop's value of a joint is sign * value + shift
  double link[6][12];
  int pose_link;      // the link (B..E) that is  before * X * after,  X = T or its inverse
  bool pose_inverted;
  double before[12], after[12];
  double disturbance; // of the links, in sizes and radians
  // Joint motions at the sample points of c, d, e: [entry][sample], 12 entries each.
  alignas(64) double motion[3][12][PADDED_SAMPLES];
  // Values at the samples -> coefficients of (power of d, power of e, basis of c), all falling.
  alignas(64) double to_coefficients[SAMPLES][PADDED_SAMPLES];
  double annihilate[6][INVARIANTS], annihilate_constant[6];  // rows orthogonal to everything with a and b
  double recover[8][INVARIANTS], recover_constant[8];        // the products of a's and b's basis
};

// The determinant is taken at more points than its coefficients need: what is left over is noise.
constexpr int TRIG_SAMPLES = 24;
struct TrigTables {
  alignas(64) double c[TRIG_SAMPLES], s[TRIG_SAMPLES];
  alignas(64) double re[TRIG_SAMPLES / 2][TRIG_SAMPLES], im[TRIG_SAMPLES / 2][TRIG_SAMPLES];
};

// Of an arm with two slides `pair` holds the eliminations, of any other `elimination`; best first.
struct General6R {
  int eliminations;
  bool is_deficient;  // its joints do not move the tool in all six ways anywhere: solutions are continua
  double size;
  const Elimination* elimination;
  const SlidePair* pair;
  const TrigTables* tables;

  double disturbance(int which) const { return pair ? 0.0 : elimination[which].disturbance; }
  // in whose angle the first one's polynomial is written
  int first_joint() const { return !eliminations ? 0 : pair ? pair[0].joint[0] : elimination[0].joint[C]; }
};

// What one elimination found for one pose. value[k][root]: joint k, then the position error and the
// rotation error of the polished root.
struct RootBlock {
  alignas(64) double value[8][MAX_ROOTS];
  double angle[MAX_ROOTS];  // of the root before polishing
  unsigned exact, verified, inside, singular;
  int candidates;     // roots on or near the unit circle, polished
  int real;           // roots on the unit circle within rounding
  int complex;        // the others
  int strayed;        // of the real ones, how many were polished into something else
  double gap;         // smallest between neighbouring real roots [rad]
  double off_circle;  // smallest |log |root|| of the others
  double blur;        // how far roots are from fulfilling the symmetry they must have
  double noise;       // coefficients that should vanish, as a part of the largest
};

}  // namespace kinverse
