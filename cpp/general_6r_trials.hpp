// Which eliminations of a six-joint arm are worth keeping: found by trying all on poses of the arm.
#pragma once

#include <utility>
#include <vector>

#include "general_6r_setup.hpp"

namespace kinverse {

struct ChosenEliminations {
  std::vector<Elimination> eliminations;  // best first; of an arm with two slides `pairs` instead
  std::vector<SlidePair> pairs;
  bool is_deficient = false;
  std::vector<std::pair<int, double>> kept;  // loop and disturbance of each
  double recall = 0.0;  // how many of the solutions of the trial poses the first one found, 0..1
};

// `exact`: the error [m, rad] that rounding explains.
ChosenEliminations choose_eliminations(const Chain& chain, double size, double exact);

}  // namespace kinverse
