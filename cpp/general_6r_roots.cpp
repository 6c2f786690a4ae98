#include "general_6r_roots.hpp"

#include <algorithm>
#include <cmath>

namespace kinverse {
namespace {

constexpr double PI = 3.14159265358979323846;
constexpr double TWO_PI = 2.0 * PI;
constexpr double SAME_SOLUTION = 1e-6, VERY_CLOSE = 2e-5, CLOSE = 1e-3;
constexpr double SPACING = 0.5;  // of members of a continuum [rad, sizes]
constexpr double ROUNDING = 2.5e-15, UNFINISHED = 1e-12;  // errors in sizes and radians

// Where the evidence of an elimination is too weak to stand alone.
constexpr double LEAST_OFF_CIRCLE = 1e-3;  // a pair of roots this near the unit circle may be real
constexpr double LEAST_GAP = 1e-5;         // two real roots this close may be one, or three
constexpr double MOST_NOISE = 1e-6;
constexpr double MOST_BLUR = 1e-6;

}  // namespace

void RootSet::clear() {
  count_ = 0;
  moved_ = false;
  best_error_ = 1e300;
}

int RootSet::exact() const {
  return static_cast<int>(std::count_if(root_, root_ + count_, [](const Root& r) { return r.exact; }));
}

bool RootSet::any_inside() const {
  return std::any_of(root_, root_ + count_, [](const Root& r) { return r.inside; });
}

bool RootSet::any_singular() const {
  return std::any_of(root_, root_ + count_, [](const Root& r) { return r.singular; });
}

double RootSet::distance(const double* a, const double* b) const {
  double largest = 0.0;
  for (int i = 0; i < 6; ++i) {
    const int j = chain_.source[i];
    double d = std::fabs(a[j] - b[j]);
    if (chain_.prismatic[i])
      d /= size_;
    else if (d > PI)
      d = std::fabs(std::remainder(d, TWO_PI));
    largest = std::max(largest, d);
  }
  return largest;
}

void RootSet::merge(const RootBlock& block) {
  for (int k = 0; k < block.candidates; ++k) {
    Root r;
    for (size_t j = 0; j < 6; ++j) r.q[j] = block.value[j][k];
    r.position_error = block.value[6][k];
    r.rotation_error = block.value[7][k];
    const double error = r.error();
    if (!(error < 1e300)) continue;
    r.exact = block.exact >> k & 1u;
    r.verified = block.verified >> k & 1u;
    r.inside = block.inside >> k & 1u;
    r.singular = block.singular >> k & 1u;
    if (error < best_error_) {
      best_error_ = error;
      best_ = r;
    }
    if (!r.verified) continue;
    int same = 0;
    while (same < count_ && !are_same(root_[same], r)) ++same;
    if (same < count_) {
      if (error < root_[same].error()) {
        root_[same] = r;
        moved_ = true;
      }
    } else if (count_ < MOST) {
      root_[count_++] = r;
    } else if (r.inside) {
      Root* outside = std::find_if(root_, root_ + MOST, [](const Root& held) { return !held.inside; });
      if (outside != root_ + MOST) *outside = r;
    }
  }
}

void RootSet::drop_misses() {
  if (exact())
    count_ = static_cast<int>(std::remove_if(root_, root_ + count_, [](const Root& r) { return !r.exact; }) - root_);
}

void RootSet::represent(const double* reference) {
  drop_misses();
  std::sort(root_, root_ + count_, [&](const Root& a, const Root& b) {
    if (a.inside != b.inside) return a.inside;
    return distance(a.q.data(), reference) < distance(b.q.data(), reference);
  });
  int kept = 0;
  for (int k = 0; k < count_ && kept < MAX_ROOTS; ++k) {
    int near = 0;
    while (near < kept && distance(root_[near].q.data(), root_[k].q.data()) > SPACING) ++near;
    if (near == kept) root_[kept++] = root_[k];
  }
  count_ = kept;
}

void RootSet::finish(int first) {
  drop_misses();
  if (moved_) unite();
  auto key = [&](const Root& r, int k) {
    const int i = k == 0 ? first : k - 1, j = chain_.source[i];
    return chain_.prismatic[i] ? r.q[static_cast<size_t>(j)] : std::remainder(r.q[static_cast<size_t>(j)], TWO_PI);
  };
  std::sort(root_, root_ + count_, [&](const Root& a, const Root& b) {
    for (int k = 0; k < 7; ++k)
      if (key(a, k) != key(b, k)) return key(a, k) < key(b, k);
    return false;
  });
  count_ = std::min(count_, MAX_ROOTS);
}

// A root that a better one replaced may have come to lie on another.
void RootSet::unite() {
  std::sort(root_, root_ + count_, [](const Root& a, const Root& b) { return a.error() < b.error(); });
  int kept = 0;
  for (int k = 0; k < count_; ++k) {
    int same = 0;
    while (same < kept && !are_same(root_[same], root_[k])) ++same;
    if (same == kept) root_[kept++] = root_[k];
  }
  count_ = kept;
}

// Near a double root the error hardly changes, and the iteration ends anywhere in some stretch. A
// root that is one of its own is left with rounding only; what is not belongs to the one close by.
bool RootSet::are_same(const Root& a, const Root& b) const {
  const double d = distance(a.q.data(), b.q.data());
  if (d < SAME_SOLUTION || d > CLOSE) return d < SAME_SOLUTION;
  const double left = std::max(std::max(a.position_error, b.position_error) / size_,
                               std::max(a.rotation_error, b.rotation_error));
  return left > (d < VERY_CLOSE ? ROUNDING : UNFINISHED);
}

// What the coefficients are uncertain by, a disturbance or noise, moves double roots by its square root.
bool is_weak(double disturbance, const RootBlock& block, int distinct) {
  const double off_circle =
      std::max({LEAST_OFF_CIRCLE, 2.0 * std::sqrt(disturbance), 50.0 * std::sqrt(block.noise)});
  return block.real != distinct || (block.real & 1) || block.strayed || block.off_circle < off_circle ||
         block.gap < LEAST_GAP || !(block.noise < MOST_NOISE) || !(block.blur < MOST_BLUR);
}

}  // namespace kinverse
