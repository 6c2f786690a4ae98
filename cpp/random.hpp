// Random numbers that come out alike everywhere: splitmix64 (Steele, Lea and Flood 2014); and random
// joint values of six joints.
#pragma once

#include <cstdint>

#include "chain.hpp"

namespace kinverse {

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double uniform(double low, double high) {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    z ^= z >> 31;
    return low + (high - low) * static_cast<double>(z >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
};

// Any angle, slides in their limits: for trials and starts.
inline void random_joints(const Chain& chain, Random& random, double* q) {
  constexpr double PI = 3.14159265358979323846;
  for (int i = 0; i < 6; ++i) {
    const int j = chain.source[i];
    q[j] = chain.prismatic[i] ? random.uniform(chain.lower[j], chain.upper[j]) : random.uniform(-PI, PI);
  }
}

}  // namespace kinverse
