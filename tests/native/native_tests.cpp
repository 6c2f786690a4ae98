// The core without Python, made to be run under address and undefined-behaviour sanitizers: the
// elementary functions, and every kernel on random, extreme and meaningless numbers. What is right is
// tested from Python; here nothing may read or write where it should not.
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "analytic.hpp"
#include "dispatch.hpp"
#include "least_squares_setup.hpp"
#include "redundant.hpp"

namespace kinverse {
namespace baseline {
bool check_elementary_functions();
}
namespace avx2 {
bool check_elementary_functions();
}
namespace avx512 {
bool check_elementary_functions();
}
}  // namespace kinverse

namespace {

using namespace kinverse;

std::mt19937_64 generator(5);

double uniform(double low, double high) {
  return low + (high - low) * static_cast<double>(generator() >> 11) * 0x1p-53;
}

// Mostly ordinary numbers, sometimes what no caller should send.
double wild(double scale) {
  switch (generator() % 40) {
    case 0: return std::numeric_limits<double>::quiet_NaN();
    case 1: return std::numeric_limits<double>::infinity();
    case 2: return 1e300;
    case 3: return -1e-300;
    case 4: return 0.0;
    default: return uniform(-scale, scale);
  }
}

void random_rotation(double* m, bool broken) {
  double w = uniform(-1, 1), x = uniform(-1, 1), y = uniform(-1, 1), z = uniform(-1, 1);
  const double n = std::sqrt(w * w + x * x + y * y + z * z) + 1e-9;
  w /= n, x /= n, y /= n, z /= n;
  const double R[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                       2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                       2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m[4 * i + j] = R[3 * i + j];
    m[4 * i + 3] = broken ? wild(1.0) : uniform(-1, 1);
  }
  if (broken) m[generator() % 12] = wild(2.0);
}

OwnedChain random_chain(int joints, bool mimic) {
  OwnedChain chain;
  for (int i = 0; i <= joints; ++i) {
    double m[12];
    random_rotation(m, false);
    chain.frames.insert(chain.frames.end(), m, m + 12);
  }
  int dof = 0;
  for (int i = 0; i < joints; ++i) {
    chain.prismatic.push_back(generator() % 4 == 0);
    const bool follows = mimic && i > 0 && generator() % 3 == 0;
    chain.source.push_back(follows ? static_cast<int>(generator() % static_cast<unsigned>(dof)) : dof++);
    chain.multiplier.push_back(follows ? uniform(-2, 2) : 1.0);
    chain.offset.push_back(follows ? uniform(-1, 1) : 0.0);
  }
  for (int j = 0; j < dof; ++j) {
    chain.lower.push_back(uniform(-7, 0));
    chain.upper.push_back(uniform(0, 7));
  }
  return chain;
}

std::vector<double> poses(long count, bool broken) {
  std::vector<double> T(static_cast<size_t>(16 * count), 0.0);
  for (long i = 0; i < count; ++i) {
    random_rotation(&T[static_cast<size_t>(16 * i)], broken);
    T[static_cast<size_t>(16 * i + 15)] = 1.0;
  }
  return T;
}

std::vector<double> numbers(size_t count, bool broken) {
  std::vector<double> out;
  for (size_t i = 0; i < count; ++i) out.push_back(broken ? wild(4.0) : uniform(-4, 4));
  return out;
}

void exercise_kinematics() {
  for (int joints : {1, 2, 6, 7, 16, 32})
    for (bool broken : {false, true}) {
      const OwnedChain chain = random_chain(joints, joints > 2);
      for (long count : {1L, 7L, 8L, 9L, 33L}) {
        const auto q = numbers(static_cast<size_t>(count * chain.dof()), broken);
        std::vector<double> T(static_cast<size_t>(16 * count)), J(static_cast<size_t>(6 * count * chain.dof()));
        active_kernels().forward(chain.view(), q.data(), count, T.data());
        active_kernels().forward_one_lane(chain.view(), q.data(), count, T.data());
        active_kernels().jacobian(chain.view(), q.data(), count, J.data());
      }
    }
}

void exercise_verification() {
  for (int round = 0; round < 60; ++round) {
    const OwnedChain chain = random_chain(1 + static_cast<int>(generator() % 9), true);
    const long count = 1 + static_cast<long>(generator() % 20), candidates = static_cast<long>(generator() % 60);
    auto T = poses(count, round % 3 == 0);
    long bad = -1;
    usable_poses(T.data(), count, bad);
    auto q = numbers(static_cast<size_t>(candidates * chain.dof()), round % 2 == 0);
    auto seeds = numbers(static_cast<size_t>(count * chain.dof()), false);
    std::vector<std::int64_t> index;
    std::vector<std::int32_t> branch;
    for (long k = 0; k < candidates; ++k) {
      index.push_back(static_cast<std::int64_t>(generator() % static_cast<unsigned long>(count)));
      branch.push_back(static_cast<int>(k));
    }
    const std::vector<std::uint8_t> hint(static_cast<size_t>(count), 3);
    Choice choice;
    choice.task = static_cast<Task>(round % 5);
    choice.tol_position = choice.tol_rotation = round % 4 ? 1e-6 : 10.0;
    choice.all_windings = round % 5 == 0;
    choice.hold_limits = round % 7 != 0;
    const Table table = verify(chain.view(), choice, T.data(), count, q.data(), index.data(), branch.data(), candidates,
                               hint.data(), round % 2 ? Seeds{seeds.data(), false} : Seeds{}, nullptr);
    if (table.poses() != count) std::abort();
  }
}

void exercise_closed_forms() {
  const int dof_of[] = {6, 6, 5, 5, 4}, branches_of[] = {8, 8, 4, 4, 2};
  for (int round = 0; round < 60; ++round) {
    const int family = round % 5;
    ClosedFormSpec spec{};
    spec.family = static_cast<Family>(family);
    spec.regional = static_cast<Regional>(round / 5 % 4);
    spec.reversed = round % 2;
    spec.perpendicular_wrist = round % 3 == 0;
    spec.dof = dof_of[family];
    spec.branches = branches_of[family];
    spec.size = round % 11 == 0 ? 0.0 : 3.0;
    for (int i = 0; i < spec.dof; ++i) {
      spec.a[i] = round % 6 == 0 ? wild(1.0) : uniform(-1, 1);
      spec.d[i] = uniform(-1, 1);
      spec.alpha[i] = round % 4 == 0 ? HUGE_VAL : uniform(-3, 3);
      spec.cos_alpha[i] = std::cos(spec.alpha[i]);
      spec.sin_alpha[i] = round % 9 == 0 ? 0.0 : std::sin(spec.alpha[i]);
      spec.joint[i] = i;
      spec.sign[i] = 1.0;
    }
    random_rotation(spec.base_inverse, false);
    random_rotation(spec.tool_inverse, false);
    const Analytic analytic(random_chain(spec.dof, false), spec);
    const long count = 1 + static_cast<long>(generator() % 21);
    const auto T = poses(count, round % 3 == 0);
    const auto seeds = numbers(static_cast<size_t>(count * spec.dof), false);
    Choice choice;
    // a tolerance that lets everything through reaches the ranking and the singular representatives
    choice.tol_position = choice.tol_rotation = round % 2 ? 1e-6 : 100.0;
    choice.hold_limits = round % 5 != 0;
    const Seeds seed_rows = round % 2 ? Seeds{seeds.data(), false} : Seeds{};
    if (analytic.solve(T.data(), count, seed_rows, choice).poses() != count) std::abort();
    if (analytic.propose(T.data(), count, seed_rows, choice).hint.size() != static_cast<size_t>(count)) std::abort();
  }
}

void exercise_least_squares() {
  for (int round = 0; round < 14; ++round) {
    const OwnedChain chain = random_chain(round % 8 == 0 ? 16 : 1 + static_cast<int>(generator() % 8), round % 3 == 0);
    const long count = 1 + static_cast<long>(generator() % 19);
    const auto T = poses(count, round % 4 == 0);
    const auto seeds = numbers(static_cast<size_t>(count * chain.dof()), round % 5 == 0);
    LeastSquaresSettings settings;
    settings.choice.task = static_cast<Task>(round % 5);
    settings.choice.hold_limits = round % 6 != 0;
    settings.method = static_cast<Method>(round / 2 % 4);
    settings.damping = 0.1;
    settings.max_starts = round % 2 ? 7 : 30;
    settings.max_iterations = 20;
    if (round % 7 == 0) settings.max_distance = 0.5;
    const LeastSquares solver(chain, settings);
    const Seeds seed_rows = round % 2 || round % 7 == 0 ? Seeds{seeds.data(), false} : Seeds{};
    if (solver.solve(T.data(), count, seed_rows, generator()).poses() != count) std::abort();
    solver.propose(T.data(), count, seed_rows, 3);
    solver.refine(T.data(), count, seeds.data());
    if (solver.follow(T.data(), count, seeds.data(), 1, 0.3).poses() != count) std::abort();
  }
}

void exercise_seven_joints() {
  for (int round = 0; round < 40; ++round) {
    RedundantSpec spec{};
    spec.parameter = static_cast<FreeParameter>(round % 3);
    const bool whole = spec.parameter == FreeParameter::arm_angle;
    ClosedFormSpec& form = spec.form;
    form.family = round % 2 ? Family::spherical_wrist : Family::three_parallel;
    form.regional = static_cast<Regional>(round / 5 % 4);
    form.reversed = round % 4 == 0;
    form.perpendicular_wrist = round % 5 == 0;
    form.dof = whole ? 7 : 6;
    form.branches = 8;
    form.size = round % 11 == 0 ? 0.0 : 3.0;
    for (int i = 0; i < form.dof; ++i) {
      form.a[i] = round % 6 == 0 ? wild(1.0) : uniform(-1, 1);
      form.d[i] = uniform(-1, 1);
      form.alpha[i] = round % 7 == 0 ? HUGE_VAL : uniform(-3, 3);
      form.cos_alpha[i] = std::cos(form.alpha[i]);
      form.sin_alpha[i] = round % 9 == 0 ? 0.0 : std::sin(form.alpha[i]);
      form.joint[i] = i + (spec.parameter == FreeParameter::first_joint ? 1 : 0);
      form.sign[i] = 1.0;
    }
    for (double* fixed : {form.base_inverse, form.tool_inverse, spec.before_inverse, spec.behind_inverse})
      random_rotation(fixed, false);
    spec.perpendicular_shoulder = round % 4 == 0;
    spec.elbow_side = 1.0;
    spec.low = round % 8 == 0 ? 1.0 : -3.0;
    spec.high = round % 8 == 0 ? 1.0 : 3.0;
    spec.round = round % 2;
    const Redundant redundant(random_chain(7, false), spec, 1e-9);
    const long count = 1 + static_cast<long>(generator() % 5);
    const auto T = poses(count, round % 3 == 0);
    const auto seeds = numbers(static_cast<size_t>(7 * count), false);
    const auto values = numbers(static_cast<size_t>(count), round % 5 == 0);
    Choice choice;
    choice.tol_position = choice.tol_rotation = round % 2 ? 1e-6 : 100.0;
    choice.hold_limits = round % 4 != 0;
    const Seeds seed_rows = round % 3 ? Seeds{seeds.data(), false} : Seeds{};
    if (redundant.solve(T.data(), count, seed_rows, choice).poses() != count) std::abort();
    if (redundant.solve_at(T.data(), values.data(), count, seed_rows, choice).poses() != count) std::abort();
  }
}

}  // namespace

int main() {
  bool passed = true;
  for (const Kernels* kernels : available_kernels()) {
    const std::string name = kernels->name;
    std::printf("%s\n", name.c_str());
    if (name == "baseline") passed = baseline::check_elementary_functions() && passed;
#if defined(KINVERSE_X86)
    if (name == "avx2") passed = avx2::check_elementary_functions() && passed;
    if (name == "avx512") passed = avx512::check_elementary_functions() && passed;
#endif
    set_active_kernels(name);
    exercise_kinematics();
    exercise_verification();
    exercise_closed_forms();
    exercise_least_squares();
    exercise_seven_joints();
  }
  set_thread_count(2);
  exercise_closed_forms();
  exercise_least_squares();
  std::printf(passed ? "native tests passed\n" : "native tests FAILED\n");
  return passed ? 0 : 1;
}
