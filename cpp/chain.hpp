// Plain descriptions that cross the border between the instruction sets: no functions, no owners.
#pragma once

#include <cstdint>

namespace kinverse {

constexpr int MAX_JOINTS = 32;

// A serial chain in canonical form: a fixed transform, then a turn about or a slide along own z.
// frames[12*i..] is the upper 3x4 part (row major) of the transform in front of moving joint i;
// frames[12*joints..] leads from the last joint to the tool point. Moving joint i stands at
// multiplier[i] * q[source[i]] + offset[i], so that mimic joints share a free joint.
struct Chain {
  int joints;
  int dof;
  const double* frames;
  const std::uint8_t* prismatic;
  const int* source;
  const double* multiplier;
  const double* offset;
  const double* lower;  // dof
  const double* upper;  // dof
};

enum class Task : int { pose, position, position_axis, planar, schoenflies };

enum class Status : std::uint8_t { solved, out_of_limits, unreachable, not_found };

}  // namespace kinverse
