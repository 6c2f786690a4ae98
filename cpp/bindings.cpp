// The only file that knows Python.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "analytic.hpp"
#include "dispatch.hpp"
#include "general_6r.hpp"
#include "least_squares_setup.hpp"
#include "owned_chain.hpp"
#include "redundant.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace kinverse;

namespace {

template <class T, int N>
using In = nb::ndarray<const T, nb::ndim<N>, nb::c_contig, nb::device::cpu>;

template <class T>
nb::ndarray<nb::numpy, T> owned_array(std::vector<size_t> shape) {
  size_t count = 1;
  for (size_t extent : shape) count *= extent;
  T* data = new T[count ? count : 1];
  nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return nb::ndarray<nb::numpy, T>(data, shape.size(), shape.data(), owner);
}

template <class T, class U>
nb::ndarray<nb::numpy, T> copied(const std::vector<U>& from, std::vector<size_t> shape) {
  auto array = owned_array<T>(shape);
  std::copy(from.begin(), from.end(), array.data());
  return array;
}

void require(bool condition, const char* message) {
  if (!condition) throw nb::value_error(message);
}

OwnedChain make_chain(In<double, 3> frames, In<std::uint8_t, 1> prismatic, In<int, 1> source, In<double, 1> multiplier,
                      In<double, 1> offset, In<double, 2> limits) {
  size_t joints = prismatic.shape(0), dof = limits.shape(0);
  require(joints >= 1 && joints <= MAX_JOINTS, "a chain has 1 to 32 moving joints");
  require(dof >= 1 && dof <= joints, "a chain has at least one free joint and not more than moving joints");
  require(frames.shape(0) == joints + 1 && frames.shape(1) == 4 && frames.shape(2) == 4,
          "frames must have the shape (joints + 1, 4, 4)");
  require(source.shape(0) == joints && multiplier.shape(0) == joints && offset.shape(0) == joints,
          "source, multiplier and offset must have one entry per moving joint");
  require(limits.shape(1) == 2, "limits must have the shape (dof, 2)");
  OwnedChain chain;
  for (size_t i = 0; i <= joints; ++i)
    chain.frames.insert(chain.frames.end(), frames.data() + 16 * i, frames.data() + 16 * i + 12);
  chain.prismatic.assign(prismatic.data(), prismatic.data() + joints);
  chain.source.assign(source.data(), source.data() + joints);
  for (int free_joint : chain.source)
    require(free_joint >= 0 && free_joint < static_cast<int>(dof), "source names a free joint that is not there");
  chain.multiplier.assign(multiplier.data(), multiplier.data() + joints);
  chain.offset.assign(offset.data(), offset.data() + joints);
  for (size_t j = 0; j < dof; ++j) {
    chain.lower.push_back(limits(j, 0));
    chain.upper.push_back(limits(j, 1));
  }
  return chain;
}

nb::ndarray<nb::numpy, double> forward(const OwnedChain& chain, In<double, 2> q, bool one_lane) {
  require(q.shape(1) == static_cast<size_t>(chain.dof()), "q must have one column per free joint");
  auto T = owned_array<double>({q.shape(0), 4, 4});
  const Kernels& kernels = active_kernels();
  auto run = one_lane ? kernels.forward_one_lane : kernels.forward;
  const double* from = q.data();
  double* to = T.data();
  nb::gil_scoped_release unlocked;
  split_over_threads(static_cast<long>(q.shape(0)), 1024, [&](long first, long last, long) {
    run(chain.view(), from + first * chain.dof(), last - first, to + 16 * first);
  });
  return T;
}

nb::ndarray<nb::numpy, double> jacobian(const OwnedChain& chain, In<double, 2> q) {
  require(q.shape(1) == static_cast<size_t>(chain.dof()), "q must have one column per free joint");
  size_t dof = static_cast<size_t>(chain.dof());
  auto J = owned_array<double>({q.shape(0), 6, dof});
  const double* from = q.data();
  double* to = J.data();
  nb::gil_scoped_release unlocked;
  split_over_threads(static_cast<long>(q.shape(0)), 1024, [&](long first, long last, long) {
    active_kernels().jacobian(chain.view(), from + first * dof, last - first, to + 6 * dof * first);
  });
  return J;
}

nb::ndarray<nb::numpy, double> pose_costs(const OwnedChain& chain, int task, int norm, int orientation,
                                          In<double, 3> T, In<double, 1> weight, In<double, 3> q) {
  const size_t poses = T.shape(0), each = q.shape(1);
  require(task >= 0 && task <= static_cast<int>(Task::schoenflies), "unknown task");
  require(norm >= 0 && norm <= static_cast<int>(Norm::squared), "unknown norm");
  require(orientation >= 0 && orientation <= static_cast<int>(Orientation::euler), "unknown orientation error");
  require(T.shape(1) == 4 && T.shape(2) == 4, "T must have the shape (N, 4, 4)");
  require(weight.shape(0) == poses, "one weight per pose");
  require(q.shape(0) == poses && q.shape(2) == static_cast<size_t>(chain.dof()), "q must have the shape (N, K, dof)");
  const CostSpec spec{static_cast<Task>(task), static_cast<Norm>(norm), static_cast<Orientation>(orientation)};
  auto cost = owned_array<double>({poses, each});
  const size_t row = each * static_cast<size_t>(chain.dof());
  nb::gil_scoped_release unlocked;
  split_over_threads(static_cast<long>(poses), 1, [&](long first, long last, long) {
    active_kernels().pose_costs(chain.view(), spec, T.data() + 16 * first, weight.data() + first,
                                q.data() + static_cast<size_t>(first) * row, last - first, static_cast<long>(each),
                                cost.data() + static_cast<size_t>(first) * each);
  });
  return cost;
}

// ---- verified answers ---------------------------------------------------------------------------

// A view of a table's memory that keeps the table alive.
template <class T, class U>
nb::object view(nb::handle owner, const Buffer<U>& buffer, std::vector<size_t> shape) {
  static_assert(sizeof(T) == sizeof(U));
  static const T nothing{};
  const T* data = buffer.data() ? reinterpret_cast<const T*>(buffer.data()) : &nothing;
  return nb::ndarray<nb::numpy, const T>(data, shape.size(), shape.data(), owner).cast();
}

// The nearest miss of each pose; of a solved pose, its solution with the least error.
struct Best {
  nb::ndarray<nb::numpy, double> q, position_error, rotation_error;
};
Best best_of(const Table& table) {
  const size_t poses = static_cast<size_t>(table.poses()), dof = static_cast<size_t>(table.dof());
  Best best{owned_array<double>({poses, dof}), owned_array<double>({poses}), owned_array<double>({poses})};
  const double none = std::numeric_limits<double>::quiet_NaN();
  std::fill_n(best.q.data(), poses * dof, none);
  std::fill_n(best.position_error.data(), poses, none);
  std::fill_n(best.rotation_error.data(), poses, none);
  auto offer = [&](std::int64_t pose, const double* q, double position, double rotation) {
    double& held = best.position_error.data()[pose];
    if (!std::isnan(held) && std::fmax(held, best.rotation_error.data()[pose]) <= std::fmax(position, rotation)) return;
    held = position;
    best.rotation_error.data()[pose] = rotation;
    std::copy(q, q + dof, best.q.data() + static_cast<size_t>(pose) * dof);
  };
  for (long k = 0; k < table.solutions(); ++k)
    offer(table.pose_index[k], table.q.data() + k * table.dof(), table.position_error[k], table.rotation_error[k]);
  for (long k = 0; k < table.best_pose.size(); ++k)
    offer(table.best_pose[k], table.best_q.data() + k * table.dof(), table.best_position_error[k],
          table.best_rotation_error[k]);
  return best;
}

nb::object evaluations_of(nb::handle owner, const Table& table) {
  const size_t poses = static_cast<size_t>(table.poses());
  if (table.evaluations.size()) return view<std::int64_t>(owner, table.evaluations, {poses});
  auto counts = owned_array<std::int64_t>({poses});
  std::fill_n(counts.data(), poses, table.evaluations_each);
  return counts.cast();
}

// The rows of Evidence as NumPy knows them.
nb::object evidence_type() {
  nb::list fields;
  for (auto [name, kind] : {std::pair{"root_gap", "f8"}, {"root_margin", "f8"}, {"real_roots", "i4"},
                            {"complex_roots", "i4"}, {"method", "u1"}, {"weak", "?"}})
    fields.append(nb::make_tuple(name, kind));
  return nb::module_::import_("numpy").attr("dtype")(fields);
}

nb::object evidence_rows(const Evidence* from, size_t count) {
  auto bytes = owned_array<std::uint8_t>({count * EVIDENCE_BYTES});
  for (size_t i = 0; i < count; ++i) std::memcpy(bytes.data() + i * EVIDENCE_BYTES, from + i, EVIDENCE_BYTES);
  return bytes.cast().attr("view")(evidence_type());
}

nb::object evidence_of(const Table& table) {
  if (table.evidence.size()) return evidence_rows(table.evidence.data(), static_cast<size_t>(table.poses()));
  std::vector<Evidence> rows(static_cast<size_t>(table.poses()));
  for (size_t i = 0; i < rows.size(); ++i) {
    const Status status = static_cast<Status>(table.status[static_cast<long>(i)]);
    rows[i].method = status == Status::unreachable ? Ground::bounds : table.method;
    rows[i].weak = rows[i].method < Ground::closed_form || status == Status::not_found;
  }
  return evidence_rows(rows.data(), rows.size());
}

// What a method counted under this name; -1 where it did not.
nb::object counter_of(nb::handle owner, const Table& table, const char* name) {
  for (const auto& [known, column] : table.columns)
    if (known == name) return view<std::int64_t>(owner, column, {static_cast<size_t>(column.size())});
  auto none = owned_array<std::int64_t>({static_cast<size_t>(table.poses())});
  std::fill_n(none.data(), table.poses(), std::int64_t{-1});
  return none.cast();
}

using PoseArray = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;

// The poses and seeds of a call when they are plain arrays that can be used as they stand. Anything
// else (another type, a bad pose) gives nothing: Python then converts it or says what is wrong.
constexpr double MOST_SEED = 1e6;  // windings beyond this leave no digits
struct PlainCall {
  PoseArray T_array, seed_array;
  std::vector<double> projected;
  const double* T = nullptr;
  long poses = 0;
  Seeds seeds;
};
bool plain_call(nb::handle T, nb::handle q_seed, int dof, PlainCall& call) {
  if (!nb::try_cast<PoseArray>(T, call.T_array, false)) return false;
  const PoseArray& array = call.T_array;
  const size_t rank = array.ndim();
  if (rank < 2 || rank > 3 || array.shape(rank - 1) != 4 || array.shape(rank - 2) != 4) return false;
  call.poses = rank == 2 ? 1 : static_cast<long>(array.shape(0));
  call.T = array.data();
  long bad = -1;
  call.projected = usable_poses(call.T, call.poses, bad);
  if (bad >= 0) return false;
  if (!call.projected.empty()) call.T = call.projected.data();
  if (q_seed.is_none()) return true;
  if (!nb::try_cast<PoseArray>(q_seed, call.seed_array, false)) return false;
  const PoseArray& seed = call.seed_array;
  const bool shared = seed.ndim() == 1;
  if (seed.ndim() < 1 || seed.ndim() > 2 || seed.shape(seed.ndim() - 1) != static_cast<size_t>(dof)) return false;
  if (!shared && seed.shape(0) != static_cast<size_t>(call.poses)) return false;
  for (size_t k = 0; k < seed.size(); ++k)
    if (!(std::fabs(seed.data()[k]) <= MOST_SEED)) return false;
  call.seeds = {seed.data(), shared};
  return true;
}

Choice make_choice(int task, double tol_position, double tol_rotation, bool all_windings, bool ignore_limits,
                   double exact = std::numeric_limits<double>::infinity()) {
  require(task >= 0 && task <= static_cast<int>(Task::schoenflies), "unknown task");
  return {static_cast<Task>(task), tol_position, tol_rotation, all_windings, !ignore_limits, exact};
}

Table* verify_candidates(const OwnedChain& chain, int task, In<double, 3> T, In<double, 2> q,
                         In<std::int64_t, 1> pose_index, In<std::int32_t, 1> branch, In<std::uint8_t, 1> hint,
                         std::optional<In<double, 2>> q_seed, double tol_position, double tol_rotation,
                         bool all_windings, bool ignore_limits, double exact,
                         std::optional<In<bool, 1>> singular) {
  const size_t poses = T.shape(0), count = q.shape(0), dof = static_cast<size_t>(chain.dof());
  require(T.shape(1) == 4 && T.shape(2) == 4, "T must have the shape (N, 4, 4)");
  require(q.shape(1) == dof, "q must have one column per free joint");
  require(pose_index.shape(0) == count && branch.shape(0) == count, "one pose and one branch per candidate");
  require(hint.shape(0) == poses, "one hint per pose");
  for (size_t k = 0; k < poses; ++k) require(hint(k) <= static_cast<int>(Status::not_found), "unknown status in hint");
  for (size_t k = 0; k < count; ++k)
    require(pose_index(k) >= 0 && pose_index(k) < static_cast<std::int64_t>(poses), "pose_index out of range");
  Seeds seeds;
  if (q_seed) {
    require(q_seed->shape(0) == poses && q_seed->shape(1) == dof, "q_seed must have the shape (N, dof)");
    seeds.rows = q_seed->data();
  }
  if (singular) require(singular->shape(0) == poses, "one singular flag per pose");
  const Choice choice = make_choice(task, tol_position, tol_rotation, all_windings, ignore_limits, exact);
  nb::gil_scoped_release unlocked;
  long bad = -1;
  const std::vector<double> projected = usable_poses(T.data(), static_cast<long>(poses), bad);
  return new Table(verify(chain.view(), choice, projected.empty() ? T.data() : projected.data(),
                          static_cast<long>(poses), q.data(), pose_index.data(), branch.data(),
                          static_cast<long>(count), hint.data(), seeds,
                          singular ? reinterpret_cast<const std::uint8_t*>(singular->data()) : nullptr));
}

// ---- closed forms -------------------------------------------------------------------------------

struct ClosedForm {
  Analytic analytic;
  Choice choice;
};

// Arrays of an arm's rows; `dof` of them.
ClosedFormSpec make_spec(size_t dof, int family, int regional, bool reversed, bool perpendicular_wrist,
                         In<double, 2> links, In<double, 2> base_inverse, In<double, 2> tool_inverse, In<int, 1> joint,
                         size_t joints, In<double, 1> sign, In<double, 1> offset) {
  require(family >= 0 && family <= static_cast<int>(Family::scara), "unknown family");
  require(regional >= 0 && regional <= static_cast<int>(Regional::intersecting_23), "unknown regional structure");
  require(links.shape(0) == dof && links.shape(1) == 5, "links must have the shape (dof, 5): a, d, alpha, cos, sin");
  require(joint.shape(0) == dof && sign.shape(0) == dof && offset.shape(0) == dof, "one joint, sign and offset each");
  for (const auto* fixed : {&base_inverse, &tool_inverse})
    require(fixed->shape(0) == 4 && fixed->shape(1) == 4, "base_inverse and tool_inverse must be (4, 4)");
  ClosedFormSpec spec{};
  spec.family = static_cast<Family>(family);
  spec.regional = static_cast<Regional>(regional);
  spec.reversed = reversed;
  spec.perpendicular_wrist = perpendicular_wrist;
  spec.dof = static_cast<int>(dof);
  const int branches[] = {8, 8, 4, 4, 2};
  spec.branches = branches[family];
  for (size_t i = 0; i < dof; ++i) {
    spec.a[i] = links(i, 0);
    spec.d[i] = links(i, 1);
    spec.alpha[i] = links(i, 2);
    spec.cos_alpha[i] = links(i, 3);
    spec.sin_alpha[i] = links(i, 4);
    spec.size += std::fabs(spec.a[i]) + std::fabs(spec.d[i]);
    require(joint(i) >= 0 && joint(i) < static_cast<int>(joints), "joint out of range");
    spec.joint[i] = joint(i);
    spec.sign[i] = sign(i);
    spec.offset[i] = offset(i);
  }
  std::copy_n(base_inverse.data(), 12, spec.base_inverse);
  std::copy_n(tool_inverse.data(), 12, spec.tool_inverse);
  return spec;
}

ClosedForm make_closed_form(const OwnedChain& chain, int family, int regional, bool reversed, bool perpendicular_wrist,
                            In<double, 2> links, In<double, 2> base_inverse, In<double, 2> tool_inverse,
                            In<int, 1> joint, In<double, 1> sign, In<double, 1> offset, double tol_position,
                            double tol_rotation, bool ignore_limits, double exact, double deviation) {
  const size_t dof = static_cast<size_t>(chain.dof());
  require(dof <= 6 && chain.joints() == chain.dof(), "a closed form has at most six joints and no mimic joints");
  ClosedFormSpec spec = make_spec(dof, family, regional, reversed, perpendicular_wrist, links, base_inverse,
                                        tool_inverse, joint, dof, sign, offset);
  spec.position_deviation = spec.rotation_deviation = deviation;
  return {Analytic(chain, spec), make_choice(0, tol_position, tol_rotation, false, ignore_limits, exact)};
}

Table* solve_closed_form(const ClosedForm& form, nb::handle T, nb::handle q_seed, nb::handle) {
  PlainCall call;
  if (!plain_call(T, q_seed, form.analytic.spec().dof, call)) return nullptr;
  nb::gil_scoped_release unlocked;
  return new Table(form.analytic.solve(call.T, call.poses, call.seeds, form.choice));
}

nb::object rows(const Candidates& found, int dof) {
  const size_t count = found.branch.size(), poses = found.hint.size();
  return nb::make_tuple(copied<double>(found.q, {count, static_cast<size_t>(dof)}),
                        copied<std::int64_t>(found.pose_index, {count}), copied<std::int32_t>(found.branch, {count}),
                        copied<std::uint8_t>(found.hint, {poses}), copied<bool>(found.singular, {poses}),
                        evidence_rows(found.evidence.data(), poses));
}

nb::object propose_closed_form(const ClosedForm& form, nb::handle T, nb::handle q_seed) {
  PlainCall call;
  if (!plain_call(T, q_seed, form.analytic.spec().dof, call)) return nb::none();
  Candidates found;
  {
    nb::gil_scoped_release unlocked;
    found = form.analytic.propose(call.T, call.poses, call.seeds, form.choice);
  }
  return rows(found, form.analytic.spec().dof);
}

// ---- six joints of any kind ---------------------------------------------------------------------

struct GeneralForm {
  General6RSolver solver;
  Choice choice;
};

GeneralForm make_general(const OwnedChain& chain, double tol_position, double tol_rotation, bool ignore_limits,
                         double exact) {
  require(chain.dof() == 6 && chain.joints() == 6, "the general form is for six joints, none a mimic");
  return {General6RSolver(chain, exact), make_choice(0, tol_position, tol_rotation, false, ignore_limits)};
}

Table* solve_general(const GeneralForm& form, nb::handle T, nb::handle q_seed, nb::handle) {
  PlainCall call;
  if (!plain_call(T, q_seed, 6, call)) return nullptr;
  nb::gil_scoped_release unlocked;
  return new Table(form.solver.solve(call.T, call.poses, call.seeds, form.choice));
}

nb::object propose_general(const GeneralForm& form, nb::handle T, nb::handle q_seed) {
  PlainCall call;
  if (!plain_call(T, q_seed, 6, call)) return nb::none();
  Candidates found;
  {
    nb::gil_scoped_release unlocked;
    found = form.solver.propose(call.T, call.poses, call.seeds, form.choice);
  }
  return rows(found, 6);
}

// ---- seven joints -------------------------------------------------------------------------------

struct RedundantForm {
  Redundant redundant;
  Choice choice;
};

RedundantForm make_redundant(const OwnedChain& chain, int parameter, int family, int regional, bool reversed,
                             bool perpendicular_wrist, bool perpendicular_shoulder, In<double, 2> links,
                             In<double, 2> base_inverse, In<double, 2> tool_inverse, In<int, 1> joint,
                             In<double, 1> sign, In<double, 1> offset, In<double, 2> before_inverse,
                             In<double, 2> behind_inverse, double elbow_side, double low, double high, bool round,
                             double tol_position, double tol_rotation, bool ignore_limits, double exact) {
  require(chain.dof() == 7 && chain.joints() == 7, "a redundant form has seven joints and no mimic joints");
  require(parameter >= 0 && parameter <= static_cast<int>(FreeParameter::arm_angle), "unknown parameter");
  for (int i = 0; i < 7; ++i)
    require(!chain.prismatic[static_cast<size_t>(i)], "a redundant form has revolute joints only");
  const bool whole = parameter == static_cast<int>(FreeParameter::arm_angle);
  require(whole || family <= static_cast<int>(Family::three_parallel), "the arm that remains must be of six joints");
  require(low <= high && high - low <= 6.2832, "the parameter's range must be at most a turn");
  for (const auto* fixed : {&before_inverse, &behind_inverse})
    require(fixed->shape(0) == 4 && fixed->shape(1) == 4, "before_inverse and behind_inverse must be (4, 4)");
  RedundantSpec spec{};
  spec.form = make_spec(whole ? 7 : 6, family, regional, reversed, perpendicular_wrist, links, base_inverse,
                        tool_inverse, joint, 7, sign, offset);
  spec.parameter = static_cast<FreeParameter>(parameter);
  std::copy_n(before_inverse.data(), 12, spec.before_inverse);
  std::copy_n(behind_inverse.data(), 12, spec.behind_inverse);
  spec.perpendicular_shoulder = perpendicular_shoulder;
  spec.elbow_side = elbow_side;
  spec.low = low;
  spec.high = high;
  spec.round = round;
  return {Redundant(chain, spec, exact), make_choice(0, tol_position, tol_rotation, false, ignore_limits, exact)};
}

Table* solve_redundant(const RedundantForm& form, nb::handle T, nb::handle q_seed, nb::handle) {
  PlainCall call;
  if (!plain_call(T, q_seed, 7, call)) return nullptr;
  nb::gil_scoped_release unlocked;
  return new Table(form.redundant.solve(call.T, call.poses, call.seeds, form.choice));
}

Table* solve_redundant_at(const RedundantForm& form, nb::handle T, In<double, 1> value, nb::handle q_seed) {
  PlainCall call;
  if (!plain_call(T, q_seed, 7, call) || value.shape(0) != static_cast<size_t>(call.poses)) return nullptr;
  nb::gil_scoped_release unlocked;
  return new Table(form.redundant.solve_at(call.T, value.data(), call.poses, call.seeds, form.choice));
}

// ---- least squares ------------------------------------------------------------------------------

nb::object estimate_arrays(const Estimate& estimate, int dof) {
  const size_t poses = estimate.found.size();
  auto q = owned_array<double>({poses, static_cast<size_t>(dof)});
  std::copy(estimate.q.begin(), estimate.q.end(), q.data());
  auto copied = [&]<class U>(const std::vector<U>& from) {
    auto to = owned_array<U>({poses});
    std::copy(from.begin(), from.end(), to.data());
    return to;
  };
  return nb::make_tuple(q, copied(estimate.found), copied(estimate.evaluations), copied(estimate.iterations),
                        copied(estimate.starts), copied(estimate.stop));
}

LeastSquares make_least_squares(const OwnedChain& chain, int task, int method, double tol_position, double tol_rotation,
                                double weight_position, double weight_rotation, double max_distance, double damping,
                                double step_tolerance, double gradient_tolerance, int max_starts, int max_iterations,
                                bool ignore_limits) {
  require(method >= 0 && method <= static_cast<int>(Method::damped_least_squares), "unknown method");
  require(max_starts >= 1 && max_starts <= 100000, "max_starts must lie in 1..100000");
  require(max_iterations >= 1 && max_iterations <= 100000, "max_iterations must lie in 1..100000");
  require(weight_position > 0.0 && weight_rotation > 0.0, "weights must be positive");
  require(max_distance >= 0.0, "max_distance must not be negative");
  return LeastSquares(chain, {make_choice(task, tol_position, tol_rotation, false, ignore_limits),
                              static_cast<Method>(method), weight_position, weight_rotation, max_distance, damping,
                              step_tolerance, gradient_tolerance, max_starts, max_iterations});
}

Table* solve_least_squares(const LeastSquares& solver, nb::handle T, nb::handle q_seed, std::uint64_t seed) {
  PlainCall call;
  if (!plain_call(T, q_seed, solver.dof(), call)) return nullptr;
  nb::gil_scoped_release unlocked;
  return new Table(solver.solve(call.T, call.poses, call.seeds, seed));
}

template <class Work>
nb::object estimate(const LeastSquares& solver, nb::handle T, nb::handle q_seed, Work work) {
  PlainCall call;
  require(plain_call(T, q_seed, solver.dof(), call), "T and q_seed must be checked arrays");
  std::optional<Estimate> found;
  {
    nb::gil_scoped_release unlocked;
    found = work(call);
  }
  return estimate_arrays(*found, solver.dof());
}

}  // namespace

NB_MODULE(_core, m) {
  // Robots and solvers kept in a script's globals outlive the interpreter's clean-up: no reason to
  // print a warning on the user's terminal.
  nb::set_leak_warnings(false);
  // a function: the stub is made where there is no NumPy
  m.def("evidence_type", &evidence_type);
  m.def("set_threads", &set_thread_count, "count"_a);
  m.def("threads", &thread_count);
  m.def("instruction_sets", [] {
    std::vector<std::string> names;
    for (const Kernels* kernels : available_kernels()) names.push_back(kernels->name);
    return names;
  });
  m.def("instruction_set", [] { return std::string(active_kernels().name); });
  m.def("lanes", [] { return active_kernels().lanes; });
  m.def("set_instruction_set", &set_active_kernels, "name"_a);

  nb::class_<OwnedChain>(m, "Chain")
      .def("__init__",
           [](OwnedChain* self, In<double, 3> frames, In<std::uint8_t, 1> prismatic, In<int, 1> source,
              In<double, 1> multiplier, In<double, 1> offset, In<double, 2> limits) {
             new (self) OwnedChain(make_chain(frames, prismatic, source, multiplier, offset, limits));
           },
           "frames"_a, "prismatic"_a, "source"_a, "multiplier"_a, "offset"_a, "limits"_a)
      .def_prop_ro("dof", &OwnedChain::dof)
      .def("fk", &forward, "q"_a, "one_lane"_a = false)
      .def("jacobian", &jacobian, "q"_a)
      .def("pose_costs", &pose_costs, "task"_a, "norm"_a, "orientation"_a, "T"_a, "weight"_a, "q"_a);

  nb::class_<Table>(m, "Table")
      .def_prop_ro("q",
                   [](nb::handle_t<Table> self) {
                     const Table& t = nb::cast<const Table&>(self);
                     return view<double>(self, t.q, {static_cast<size_t>(t.solutions()), static_cast<size_t>(t.dof())});
                   })
      .def_prop_ro("pose_index",
                   [](nb::handle_t<Table> self) {
                     const Table& t = nb::cast<const Table&>(self);
                     return view<std::int64_t>(self, t.pose_index, {static_cast<size_t>(t.solutions())});
                   })
      .def_prop_ro("position_error",
                   [](nb::handle_t<Table> self) {
                     const Table& t = nb::cast<const Table&>(self);
                     return view<double>(self, t.position_error, {static_cast<size_t>(t.solutions())});
                   })
      .def_prop_ro("rotation_error",
                   [](nb::handle_t<Table> self) {
                     const Table& t = nb::cast<const Table&>(self);
                     return view<double>(self, t.rotation_error, {static_cast<size_t>(t.solutions())});
                   })
      .def_prop_ro("branch",
                   [](nb::handle_t<Table> self) {
                     const Table& t = nb::cast<const Table&>(self);
                     return view<std::int32_t>(self, t.branch, {static_cast<size_t>(t.solutions())});
                   })
      .def_prop_ro("status",
                   [](nb::handle_t<Table> self) {
                     const Table& t = nb::cast<const Table&>(self);
                     return view<std::uint8_t>(self, t.status, {static_cast<size_t>(t.poses())});
                   })
      .def_prop_ro("count",
                   [](nb::handle_t<Table> self) {
                     const Table& t = nb::cast<const Table&>(self);
                     return view<std::int64_t>(self, t.count, {static_cast<size_t>(t.poses())});
                   })
      .def_prop_ro("singular",
                   [](nb::handle_t<Table> self) {
                     const Table& t = nb::cast<const Table&>(self);
                     return view<bool>(self, t.singular, {static_cast<size_t>(t.poses())});
                   })
      .def_prop_ro("evaluations",
                   [](nb::handle_t<Table> self) { return evaluations_of(self, nb::cast<const Table&>(self)); })
      .def_prop_ro("interval_pose",
                   [](nb::handle_t<Table> self) {
                     const Table& t = nb::cast<const Table&>(self);
                     return view<std::int64_t>(self, t.interval_pose, {static_cast<size_t>(t.interval_pose.size())});
                   })
      .def_prop_ro("interval_branch",
                   [](nb::handle_t<Table> self) {
                     const Table& t = nb::cast<const Table&>(self);
                     return view<std::int32_t>(self, t.interval_branch, {static_cast<size_t>(t.interval_pose.size())});
                   })
      .def_prop_ro("interval_low",
                   [](nb::handle_t<Table> self) {
                     const Table& t = nb::cast<const Table&>(self);
                     return view<double>(self, t.interval_low, {static_cast<size_t>(t.interval_pose.size())});
                   })
      .def_prop_ro("interval_high",
                   [](nb::handle_t<Table> self) {
                     const Table& t = nb::cast<const Table&>(self);
                     return view<double>(self, t.interval_high, {static_cast<size_t>(t.interval_pose.size())});
                   })
      .def_prop_ro("not_found", [](const Table& table) { return table.not_found; })
      .def_prop_ro("evidence", &evidence_of)
      .def_prop_ro("iterations",
                   [](nb::handle_t<Table> self) { return counter_of(self, nb::cast<const Table&>(self), "iterations"); })
      .def_prop_ro("starts",
                   [](nb::handle_t<Table> self) { return counter_of(self, nb::cast<const Table&>(self), "starts"); })
      .def_prop_ro("stop",
                   [](nb::handle_t<Table> self) { return counter_of(self, nb::cast<const Table&>(self), "stop"); })
      .def_prop_ro("cost",
                   [](const Table& table) {
                     auto none = owned_array<double>({static_cast<size_t>(table.poses())});
                     std::fill_n(none.data(), table.poses(), std::numeric_limits<double>::quiet_NaN());
                     return none.cast();
                   })
      .def_prop_ro("best_q", [](const Table& table) { return best_of(table).q.cast(); })
      .def_prop_ro("best_position_error", [](const Table& table) { return best_of(table).position_error.cast(); })
      .def_prop_ro("best_rotation_error", [](const Table& table) { return best_of(table).rotation_error.cast(); });

  m.def("verify", &verify_candidates, "chain"_a, "task"_a, "T"_a, "q"_a, "pose_index"_a, "branch"_a, "hint"_a,
        "q_seed"_a.none(), "tol_position"_a, "tol_rotation"_a, "all_windings"_a, "ignore_limits"_a,
        "exact"_a = std::numeric_limits<double>::infinity(), "singular"_a.none() = nb::none(), nb::rv_policy::take_ownership);

  nb::class_<ClosedForm>(m, "ClosedForm")
      .def("__init__",
           [](ClosedForm* self, const OwnedChain& chain, int family, int regional, bool reversed,
              bool perpendicular_wrist, In<double, 2> links, In<double, 2> base_inverse, In<double, 2> tool_inverse,
              In<int, 1> joint, In<double, 1> sign, In<double, 1> offset, double tol_position, double tol_rotation,
              bool ignore_limits, double exact, double deviation) {
             new (self) ClosedForm(make_closed_form(chain, family, regional, reversed, perpendicular_wrist, links,
                                                    base_inverse, tool_inverse, joint, sign, offset, tol_position,
                                                    tol_rotation, ignore_limits, exact, deviation));
           },
           "chain"_a, "family"_a, "regional"_a, "reversed"_a, "perpendicular_wrist"_a, "links"_a, "base_inverse"_a,
           "tool_inverse"_a, "joint"_a, "sign"_a, "offset"_a, "tol_position"_a, "tol_rotation"_a, "ignore_limits"_a, "exact"_a,
           "deviation"_a)
      .def("solve", &solve_closed_form, "T"_a.none(), "q_seed"_a.none() = nb::none(), "seed"_a = 0,
           nb::rv_policy::take_ownership)
      .def("propose", &propose_closed_form, "T"_a.none(), "q_seed"_a.none() = nb::none());

  nb::class_<GeneralForm>(m, "GeneralForm")
      .def("__init__",
           [](GeneralForm* self, const OwnedChain& chain, double tol_position, double tol_rotation, bool ignore_limits,
              double exact) {
             new (self) GeneralForm(make_general(chain, tol_position, tol_rotation, ignore_limits, exact));
           },
           "chain"_a, "tol_position"_a, "tol_rotation"_a, "ignore_limits"_a, "exact"_a)
      .def_prop_ro("recall", [](const GeneralForm& form) { return form.solver.recall(); })
      .def_prop_ro("eliminations", [](const GeneralForm& form) { return static_cast<int>(form.solver.kept().size()); })
      .def("solve", &solve_general, "T"_a.none(), "q_seed"_a.none() = nb::none(), "seed"_a = 0,
           nb::rv_policy::take_ownership)
      .def("propose", &propose_general, "T"_a.none(), "q_seed"_a.none() = nb::none());

  nb::class_<RedundantForm>(m, "Redundant")
      .def("__init__",
           [](RedundantForm* self, const OwnedChain& chain, int parameter, int family, int regional, bool reversed,
              bool perpendicular_wrist, bool perpendicular_shoulder, In<double, 2> links, In<double, 2> base_inverse,
              In<double, 2> tool_inverse, In<int, 1> joint, In<double, 1> sign, In<double, 1> offset,
              In<double, 2> before_inverse, In<double, 2> behind_inverse, double elbow_side, double low, double high,
              bool round, double tol_position, double tol_rotation, bool ignore_limits, double exact) {
             new (self) RedundantForm(make_redundant(chain, parameter, family, regional, reversed, perpendicular_wrist,
                                                     perpendicular_shoulder, links, base_inverse, tool_inverse, joint,
                                                     sign, offset, before_inverse, behind_inverse, elbow_side, low, high,
                                                     round, tol_position, tol_rotation, ignore_limits, exact));
           },
           "chain"_a, "parameter"_a, "family"_a, "regional"_a, "reversed"_a, "perpendicular_wrist"_a,
           "perpendicular_shoulder"_a, "links"_a, "base_inverse"_a, "tool_inverse"_a, "joint"_a, "sign"_a, "offset"_a,
           "before_inverse"_a, "behind_inverse"_a, "elbow_side"_a, "low"_a, "high"_a, "round"_a, "tol_position"_a,
           "tol_rotation"_a, "ignore_limits"_a, "exact"_a)
      .def("solve", &solve_redundant, "T"_a, "q_seed"_a.none() = nb::none(), "seed"_a = 0,
           nb::rv_policy::take_ownership)
      .def("solve_at", &solve_redundant_at, "T"_a, "value"_a, "q_seed"_a.none() = nb::none(),
           nb::rv_policy::take_ownership);

  nb::class_<LeastSquares>(m, "LeastSquares")
      .def("__init__",
           [](LeastSquares* self, const OwnedChain& chain, int task, int method, double tol_position,
              double tol_rotation, double weight_position, double weight_rotation, double max_distance, double damping,
              double step_tolerance, double gradient_tolerance, int max_starts, int max_iterations, bool ignore_limits) {
             new (self) LeastSquares(make_least_squares(chain, task, method, tol_position, tol_rotation, weight_position,
                                                        weight_rotation, max_distance, damping, step_tolerance,
                                                        gradient_tolerance, max_starts, max_iterations, ignore_limits));
           },
           "chain"_a, "task"_a, "method"_a, "tol_position"_a, "tol_rotation"_a, "weight_position"_a,
           "weight_rotation"_a, "max_distance"_a, "damping"_a, "step_tolerance"_a, "gradient_tolerance"_a,
           "max_starts"_a, "max_iterations"_a, "ignore_limits"_a)
      .def("solve", &solve_least_squares, "T"_a.none(), "q_seed"_a.none() = nb::none(), "seed"_a = 0,
           nb::rv_policy::take_ownership)
      .def("propose",
           [](const LeastSquares& solver, nb::handle T, nb::handle q_seed, std::uint64_t seed) {
             return estimate(solver, T, q_seed,
                             [&](const PlainCall& call) { return solver.propose(call.T, call.poses, call.seeds, seed); });
           },
           "T"_a.none(), "q_seed"_a.none() = nb::none(), "seed"_a = 0)
      .def("refine",
           [](const LeastSquares& solver, nb::handle T, In<double, 2> q_start) {
             require(q_start.shape(1) == static_cast<size_t>(solver.dof()), "one column per free joint");
             return estimate(solver, T, nb::none(), [&](const PlainCall& call) {
               require(q_start.shape(0) == static_cast<size_t>(call.poses), "one start per pose");
               return solver.refine(call.T, call.poses, q_start.data());
             });
           },
           "T"_a, "q_start"_a)
      .def("follow",
           [](const LeastSquares& solver, nb::handle T, In<double, 1> q_start, std::uint64_t seed, double max_step) {
             PlainCall call;
             require(plain_call(T, nb::none(), solver.dof(), call), "T must be a checked array");
             require(q_start.shape(0) == static_cast<size_t>(solver.dof()), "one value per free joint");
             nb::gil_scoped_release unlocked;
             return new Table(solver.follow(call.T, call.poses, q_start.data(), seed, max_step));
           },
           "T"_a, "q_start"_a, "seed"_a, "max_step"_a, nb::rv_policy::take_ownership);
}
