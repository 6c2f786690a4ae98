// A chain that owns its arrays.
#pragma once

#include <vector>

#include "chain.hpp"

namespace kinverse {

struct OwnedChain {
  std::vector<double> frames, multiplier, offset, lower, upper;
  std::vector<std::uint8_t> prismatic;
  std::vector<int> source;

  int joints() const { return static_cast<int>(prismatic.size()); }
  int dof() const { return static_cast<int>(lower.size()); }
  Chain view() const {
    return {joints(),      dof(),         frames.data(), prismatic.data(), source.data(),
            multiplier.data(), offset.data(), lower.data(),  upper.data()};
  }
};

}  // namespace kinverse
