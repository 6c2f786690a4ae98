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
#include "shortest_path.hpp"

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

// An array that owns what was a vector's.
template <class T, class U>
nb::ndarray<nb::numpy, T> moved(std::vector<U> from, std::vector<size_t> shape) {
  static_assert(sizeof(T) == sizeof(U));
  static T nothing{};
  auto* held = new std::vector<U>(std::move(from));
  nb::capsule owner(held, [](void* p) noexcept { delete static_cast<std::vector<U>*>(p); });
  T* data = held->empty() ? &nothing : reinterpret_cast<T*>(held->data());
  return nb::ndarray<nb::numpy, T>(data, shape.size(), shape.data(), owner);
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

template <class T, auto COLUMN>
nb::object column(nb::handle_t<Table> self) {
  const auto& buffer = nb::cast<const Table&>(self).*COLUMN;
  return view<T>(self, buffer, {static_cast<size_t>(buffer.size())});
}

nb::object evaluations_of(nb::handle owner, const Table& table) {
  const size_t poses = static_cast<size_t>(table.poses());
  if (table.evaluations.size()) return view<std::int64_t>(owner, table.evaluations, {poses});
  return moved<std::int64_t>(std::vector(poses, table.evaluations_each), {poses}).cast();
}

// The rows of Evidence as NumPy knows them.
nb::object evidence_type() {
  nb::list fields;
  for (auto [name, kind] : {std::pair{"root_gap", "f8"}, {"root_margin", "f8"}, {"real_roots", "i4"},
                            {"complex_roots", "i4"}, {"method", "u1"}, {"weak", "?"}})
    fields.append(nb::make_tuple(name, kind));
  return nb::module_::import_("numpy").attr("dtype")(fields);
}

nb::object evidence_rows(const std::vector<Evidence>& rows) {
  auto bytes = owned_array<std::uint8_t>({rows.size() * EVIDENCE_BYTES});
  for (size_t i = 0; i < rows.size(); ++i) std::memcpy(bytes.data() + i * EVIDENCE_BYTES, &rows[i], EVIDENCE_BYTES);
  return bytes.cast().attr("view")(evidence_type());
}

// What a method counted under this name; -1 where it did not.
nb::object counter_of(nb::handle owner, const Table& table, const char* name) {
  for (const auto& [known, column] : table.columns)
    if (known == name) return view<std::int64_t>(owner, column, {static_cast<size_t>(column.size())});
  const size_t poses = static_cast<size_t>(table.poses());
  return moved<std::int64_t>(std::vector(poses, std::int64_t{-1}), {poses}).cast();
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

// What `work` makes of a call; nothing if it cannot be used as it stands.
template <class Work>
Table* answer(nb::handle T, nb::handle q_seed, int dof, Work work) {
  PlainCall call;
  if (!plain_call(T, q_seed, dof, call)) return nullptr;
  nb::gil_scoped_release unlocked;
  return new Table(work(call));
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

// A solver and how its answers are chosen.
template <class Solver>
struct Form {
  Solver solver;
  Choice choice;
};

template <class Solver>
Table* solve_form(const Form<Solver>& form, nb::handle T, nb::handle q_seed, nb::handle) {
  return answer(T, q_seed, form.solver.chain().dof(), [&](const PlainCall& call) {
    return form.solver.solve(call.T, call.poses, call.seeds, form.choice);
  });
}

template <class Solver>
nb::object propose_form(const Form<Solver>& form, nb::handle T, nb::handle q_seed) {
  const int dof = form.solver.chain().dof();
  PlainCall call;
  if (!plain_call(T, q_seed, dof, call)) return nb::none();
  Candidates found;
  {
    nb::gil_scoped_release unlocked;
    found = form.solver.propose(call.T, call.poses, call.seeds, form.choice);
  }
  const size_t count = found.branch.size(), poses = found.hint.size();
  return nb::make_tuple(moved<double>(std::move(found.q), {count, static_cast<size_t>(dof)}),
                        moved<std::int64_t>(std::move(found.pose_index), {count}),
                        moved<std::int32_t>(std::move(found.branch), {count}),
                        moved<std::uint8_t>(std::move(found.hint), {poses}),
                        moved<bool>(std::move(found.singular), {poses}), evidence_rows(found.evidence));
}

using ClosedForm = Form<Analytic>;

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

// ---- six joints of any kind ---------------------------------------------------------------------

using GeneralForm = Form<General6RSolver>;

GeneralForm make_general(const OwnedChain& chain, double tol_position, double tol_rotation, bool ignore_limits,
                         double exact) {
  require(chain.dof() == 6 && chain.joints() == 6, "the general form is for six joints, none a mimic");
  return {General6RSolver(chain, exact), make_choice(0, tol_position, tol_rotation, false, ignore_limits)};
}

// ---- seven joints -------------------------------------------------------------------------------

using RedundantForm = Form<Redundant>;

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

Table* solve_redundant_at(const RedundantForm& form, nb::handle T, In<double, 1> value, nb::handle q_seed) {
  PlainCall call;
  if (!plain_call(T, q_seed, 7, call) || value.shape(0) != static_cast<size_t>(call.poses)) return nullptr;
  nb::gil_scoped_release unlocked;
  return new Table(form.solver.solve_at(call.T, value.data(), call.poses, call.seeds, form.choice));
}

// ---- least squares ------------------------------------------------------------------------------

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
  return answer(T, q_seed, solver.dof(),
                [&](const PlainCall& call) { return solver.solve(call.T, call.poses, call.seeds, seed); });
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
  const size_t poses = found->found.size();
  return nb::make_tuple(moved<double>(std::move(found->q), {poses, static_cast<size_t>(solver.dof())}),
                        moved<std::uint8_t>(std::move(found->found), {poses}),
                        moved<std::int64_t>(std::move(found->evaluations), {poses}),
                        moved<std::int64_t>(std::move(found->iterations), {poses}),
                        moved<std::int64_t>(std::move(found->starts), {poses}),
                        moved<std::uint8_t>(std::move(found->stop), {poses}));
}

// ---- paths ---------------------------------------------------------------------------------------

constexpr double MOST_VALUE = 1e9;  // joint values and limits beyond this leave no digits to count turns

// The rows of layers, and limits and kinds of their joints.
void check_rows(In<double, 2> q, In<double, 1> lower, In<double, 1> upper, In<bool, 1> turns) {
  const size_t dof = q.shape(1);
  require(dof >= 1 && dof <= MAX_JOINTS, "q must have 1 to 32 columns");
  require(lower.shape(0) == dof && upper.shape(0) == dof && turns.shape(0) == dof,
          "lower, upper and turns must have one entry per column of q");
  auto usable = [](const double* from, size_t count) {
    return std::all_of(from, from + count, [](double x) { return std::fabs(x) <= MOST_VALUE; });
  };
  require(usable(q.data(), q.size()) && usable(lower.data(), dof) && usable(upper.data(), dof),
          "joint values and limits must be finite and within +-1e9");
}

const std::uint8_t* bytes(const In<bool, 1>& flags) { return reinterpret_cast<const std::uint8_t*>(flags.data()); }

nb::object winding_counts_of(In<double, 2> q, In<double, 1> lower, In<double, 1> upper, In<bool, 1> turns) {
  check_rows(q, lower, upper, turns);
  return moved<std::int64_t>(winding_counts(q.data(), static_cast<long>(q.shape(0)), static_cast<int>(q.shape(1)),
                                            bytes(turns), lower.data(), upper.data()),
                             {q.shape(0)}).cast();
}

nb::object windings_of(In<double, 2> q, In<double, 1> lower, In<double, 1> upper, In<bool, 1> turns, size_t most) {
  check_rows(q, lower, upper, turns);
  const long rows = static_cast<long>(q.shape(0));
  const int dof = static_cast<int>(q.shape(1));
  size_t total = 0;
  for (std::int64_t count : winding_counts(q.data(), rows, dof, bytes(turns), lower.data(), upper.data())) {
    total += static_cast<size_t>(count);
    require(total <= most, "too many windings");
  }
  auto all = owned_array<double>({total, q.shape(1)});
  write_windings(q.data(), rows, dof, bytes(turns), lower.data(), upper.data(), all.data());
  return all.cast();
}

nb::object shortest_path_of(In<double, 2> q, In<std::int64_t, 1> start, In<bool, 1> fixed,
                            In<std::int32_t, 1> side, In<double, 1> lower, In<double, 1> upper, In<bool, 1> turns, In<double, 1> max_step,
                            In<double, 1> weight, bool squares, std::optional<In<double, 1>> before,
                            In<std::int64_t, 1> open_from, In<std::int64_t, 1> open_to) {
  check_rows(q, lower, upper, turns);
  const size_t rows = q.shape(0), dof = q.shape(1);
  require(start.shape(0) >= 2 && start(0) == 0, "start must begin with 0 and have an entry more than samples");
  const size_t samples = start.shape(0) - 1;
  for (size_t i = 0; i < samples; ++i) require(start(i) <= start(i + 1), "start must not decrease");
  require(start(samples) == static_cast<std::int64_t>(rows), "start must end with the number of rows of q");
  require(side.shape(0) == rows && fixed.shape(0) == rows, "one side and one flag per row");
  require(max_step.shape(0) == dof && weight.shape(0) == dof, "one limit and one weight per joint");
  for (size_t j = 0; j < dof; ++j) {
    require(max_step(j) >= 0.0 && weight(j) >= 0.0 && weight(j) <= MOST_VALUE, "max_step and weight must not be negative");
    // with half a turn or more, which way round a joint went would be open
    require(!turns(j) || max_step(j) < 3.1415926, "max_step of a turning joint must be less than pi");
  }
  require(!before || before->shape(0) == dof, "before must have one entry per joint");
  for (size_t j = 0; before && j < dof; ++j) require(std::fabs((*before)(j)) <= MOST_VALUE, "before must be finite");
  const size_t open = open_to.shape(0);
  require(open_from.shape(0) == open, "open_from and open_to must be of one length");
  for (size_t k = 1; k < open; ++k)
    require(open_to(k - 1) < open_to(k) || (open_to(k - 1) == open_to(k) && open_from(k - 1) <= open_from(k)),
            "open pairs must ascend by to, then by from");
  PathChoice found;
  {
    nb::gil_scoped_release unlocked;
    found = shortest_path({{static_cast<int>(dof), squares, max_step.data(), weight.data(), bytes(turns)},
                           static_cast<long>(samples), start.data(), q.data(), bytes(fixed), side.data(), lower.data(),
                           upper.data(), before ? before->data() : nullptr, static_cast<long>(open), open_from.data(), open_to.data()});
  }
  const size_t barriers = found.barrier.size(), reached = found.reached_row.size();
  nb::dict told;
  told["cost"] = found.cost;
  told["q"] = moved<double>(std::move(found.q), {samples, dof});
  told["row"] = moved<std::int64_t>(std::move(found.row), {samples});
  told["linked"] = moved<bool>(std::move(found.linked), {samples});
  told["level"] = moved<std::int32_t>(std::move(found.level), {samples});
  told["barrier"] = moved<std::int64_t>(std::move(found.barrier), {barriers});
  told["reached_start"] = moved<std::int64_t>(std::move(found.reached_start), {barriers + 1});
  told["reached_row"] = moved<std::int64_t>(std::move(found.reached_row), {reached});
  told["reached_q"] = moved<double>(std::move(found.reached_q), {reached, dof});
  return told;
}

// __init__ by a function that makes the object.
template <class Made, class... Arguments>
auto init(Made (*make)(Arguments...)) {
  return [make](Made* self, Arguments... arguments) { new (self) Made(make(std::forward<Arguments>(arguments)...)); };
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

  m.def("winding_counts", &winding_counts_of, "q"_a, "lower"_a, "upper"_a, "turns"_a);
  m.def("windings", &windings_of, "q"_a, "lower"_a, "upper"_a, "turns"_a, "most"_a);
  m.def("shortest_path", &shortest_path_of, "q"_a, "start"_a, "fixed"_a, "side"_a, "lower"_a, "upper"_a, "turns"_a,
        "max_step"_a, "weight"_a, "squares"_a, "before"_a.none(), "open_from"_a, "open_to"_a);

  nb::class_<OwnedChain>(m, "Chain")
      .def("__init__", init(&make_chain),
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
      .def_prop_ro("pose_index", &column<std::int64_t, &Table::pose_index>)
      .def_prop_ro("position_error", &column<double, &Table::position_error>)
      .def_prop_ro("rotation_error", &column<double, &Table::rotation_error>)
      .def_prop_ro("branch", &column<std::int32_t, &Table::branch>)
      .def_prop_ro("status", &column<std::uint8_t, &Table::status>)
      .def_prop_ro("count", &column<std::int64_t, &Table::count>)
      .def_prop_ro("singular", &column<bool, &Table::singular>)
      .def_prop_ro("evaluations",
                   [](nb::handle_t<Table> self) { return evaluations_of(self, nb::cast<const Table&>(self)); })
      .def_prop_ro("interval_pose", &column<std::int64_t, &Table::interval_pose>)
      .def_prop_ro("interval_branch", &column<std::int32_t, &Table::interval_branch>)
      .def_prop_ro("interval_low", &column<double, &Table::interval_low>)
      .def_prop_ro("interval_high", &column<double, &Table::interval_high>)
      .def_prop_ro("not_found", [](const Table& table) { return table.not_found; })
      .def_prop_ro("evidence", [](const Table& table) { return evidence_rows(evidence_of(table)); })
      .def_prop_ro("iterations",
                   [](nb::handle_t<Table> self) { return counter_of(self, nb::cast<const Table&>(self), "iterations"); })
      .def_prop_ro("starts",
                   [](nb::handle_t<Table> self) { return counter_of(self, nb::cast<const Table&>(self), "starts"); })
      .def_prop_ro("stop",
                   [](nb::handle_t<Table> self) { return counter_of(self, nb::cast<const Table&>(self), "stop"); })
      .def_prop_ro("cost",
                   [](const Table& table) {
                     const size_t poses = static_cast<size_t>(table.poses());
                     return moved<double>(std::vector<double>(poses, std::numeric_limits<double>::quiet_NaN()), {poses}).cast();
                   })
      .def_prop_ro("best_q",
                   [](const Table& table) {
                     const size_t poses = static_cast<size_t>(table.poses()), dof = static_cast<size_t>(table.dof());
                     return moved<double>(best_of(table).q, {poses, dof}).cast();
                   })
      .def_prop_ro("best_position_error",
                   [](const Table& table) {
                     return moved<double>(best_of(table).position_error, {static_cast<size_t>(table.poses())}).cast();
                   })
      .def_prop_ro("best_rotation_error", [](const Table& table) {
        return moved<double>(best_of(table).rotation_error, {static_cast<size_t>(table.poses())}).cast();
      });

  m.def("verify", &verify_candidates, "chain"_a, "task"_a, "T"_a, "q"_a, "pose_index"_a, "branch"_a, "hint"_a,
        "q_seed"_a.none(), "tol_position"_a, "tol_rotation"_a, "all_windings"_a, "ignore_limits"_a,
        "exact"_a = std::numeric_limits<double>::infinity(), "singular"_a.none() = nb::none(), nb::rv_policy::take_ownership);

  nb::class_<ClosedForm>(m, "ClosedForm")
      .def("__init__", init(&make_closed_form),
           "chain"_a, "family"_a, "regional"_a, "reversed"_a, "perpendicular_wrist"_a, "links"_a, "base_inverse"_a,
           "tool_inverse"_a, "joint"_a, "sign"_a, "offset"_a, "tol_position"_a, "tol_rotation"_a, "ignore_limits"_a, "exact"_a,
           "deviation"_a)
      .def("solve", &solve_form<Analytic>, "T"_a.none(), "q_seed"_a.none() = nb::none(), "seed"_a = 0,
           nb::rv_policy::take_ownership)
      .def("propose", &propose_form<Analytic>, "T"_a.none(), "q_seed"_a.none() = nb::none());

  nb::class_<GeneralForm>(m, "GeneralForm")
      .def("__init__", init(&make_general),
           "chain"_a, "tol_position"_a, "tol_rotation"_a, "ignore_limits"_a, "exact"_a)
      .def_prop_ro("recall", [](const GeneralForm& form) { return form.solver.recall(); })
      .def_prop_ro("eliminations", [](const GeneralForm& form) { return static_cast<int>(form.solver.kept().size()); })
      .def("solve", &solve_form<General6RSolver>, "T"_a.none(), "q_seed"_a.none() = nb::none(), "seed"_a = 0,
           nb::rv_policy::take_ownership)
      .def("propose", &propose_form<General6RSolver>, "T"_a.none(), "q_seed"_a.none() = nb::none());

  nb::class_<RedundantForm>(m, "Redundant")
      .def("__init__", init(&make_redundant),
           "chain"_a, "parameter"_a, "family"_a, "regional"_a, "reversed"_a, "perpendicular_wrist"_a,
           "perpendicular_shoulder"_a, "links"_a, "base_inverse"_a, "tool_inverse"_a, "joint"_a, "sign"_a, "offset"_a,
           "before_inverse"_a, "behind_inverse"_a, "elbow_side"_a, "low"_a, "high"_a, "round"_a, "tol_position"_a,
           "tol_rotation"_a, "ignore_limits"_a, "exact"_a)
      .def("solve", &solve_form<Redundant>, "T"_a, "q_seed"_a.none() = nb::none(), "seed"_a = 0,
           nb::rv_policy::take_ownership)
      .def("solve_at", &solve_redundant_at, "T"_a, "value"_a, "q_seed"_a.none() = nb::none(),
           nb::rv_policy::take_ownership);

  nb::class_<LeastSquares>(m, "LeastSquares")
      .def("__init__", init(&make_least_squares),
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
