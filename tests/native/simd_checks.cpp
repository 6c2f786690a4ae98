// Accuracy of the elementary functions, compiled once per instruction set.
#include <cmath>
#include <cstdio>
#include <random>

#include "simd.hpp"

namespace kinverse::KINVERSE_ISA {
namespace {

double ulps(double value, long double truth) {
  if (value == static_cast<double>(truth)) return 0.0;
  const double unit = std::ldexp(1.0, std::ilogb(static_cast<double>(truth)) - 52);
  return std::fabs(static_cast<double>(value - truth)) / unit;
}

template <int W>
bool accurate() {
  std::mt19937_64 generator(17);
  auto uniform = [&] { return static_cast<double>(generator() >> 11) * 0x1p-53 * 2.0 - 1.0; };
  double worst_sine = 0.0, worst_cosine = 0.0, worst_atan2 = 0.0;
  const double scales[] = {1e-8, 1.0, 7.0, 1e3, 9e4, 1e9};
  for (int round = 0; round < 30000; ++round) {
    double x[W], y[W], s[W], c[W], a[W];
    for (int l = 0; l < W; ++l) {
      x[l] = uniform() * scales[round % 6];
      y[l] = uniform() * std::pow(10.0, static_cast<double>(generator() % 9) - 4.0);
    }
    Pack<W> sine, cosine;
    sincos(load<W>(x), sine, cosine);
    store(s, sine);
    store(c, cosine);
    store(a, atan2(load<W>(y), load<W>(x)));
    for (int l = 0; l < W; ++l) {
      worst_sine = std::fmax(worst_sine, ulps(s[l], sinl(x[l])));
      worst_cosine = std::fmax(worst_cosine, ulps(c[l], cosl(x[l])));
      worst_atan2 = std::fmax(worst_atan2, ulps(a[l], atan2l(y[l], x[l])));
    }
  }
  const double special[][3] = {{0.0, 1.0, 0.0},  {-0.0, 1.0, -0.0}, {0.0, -1.0, PI},       {1.0, 0.0, HALF_PI},
                               {0.0, 0.0, 0.0}, {1.0, 1.0, PI / 4}, {-1.0, -1.0, -0.75 * PI}};
  bool specials = true;
  for (const auto& t : special) {
    const double got = atan2(Pack<W>(t[0]), Pack<W>(t[1]))[W - 1];
    specials = specials && std::fabs(got - t[2]) < 2e-15 && std::signbit(got) == std::signbit(t[2]);
  }
  std::printf("  %d lanes: sin %.2f, cos %.2f, atan2 %.2f ulp%s\n", W, worst_sine, worst_cosine, worst_atan2,
              specials ? "" : ", special values wrong");
  return specials && worst_sine < 4.0 && worst_cosine < 4.0 && worst_atan2 < 4.0;
}

}  // namespace

bool check_elementary_functions() { return accurate<1>() && accurate<LANES>(); }

}  // namespace kinverse::KINVERSE_ISA
