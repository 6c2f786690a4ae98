#include "shortest_path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace kinverse {
namespace {

constexpr double TURN = 6.28318530717958647693;
constexpr double SLACK = 1e-9;  // how far outside its limits a joint value still counts as inside
constexpr std::int32_t NEVER = std::numeric_limits<std::int32_t>::max();
constexpr std::uint32_t FIRST = 0xffffffffu, JUMPED = 0x80000000u;
constexpr long MOST_NODES = 1L << 30;  // in a layer: their numbers have 31 bits, less one for FIRST

// The turns that may be added to each joint of a row.
struct Windings {
  int low[MAX_JOINTS], count[MAX_JOINTS];
  long nodes;

  Windings() = default;
  Windings(const double* q, int dof, const std::uint8_t* turns, const double* lower, const double* upper) : nodes(1) {
    for (int j = 0; j < dof; ++j) {
      int first = 0, last = q[j] >= lower[j] - SLACK && q[j] <= upper[j] + SLACK ? 0 : -1;
      if (turns[j]) {
        first = static_cast<int>(std::ceil((lower[j] - SLACK - q[j]) / TURN));
        last = static_cast<int>(std::floor((upper[j] + SLACK - q[j]) / TURN));
      }
      low[j] = first;
      count[j] = std::max(0, last - first + 1);
      nodes = std::min(nodes * count[j], MOST_NODES);
    }
  }
  void write(const double* q, int dof, long node, double* to) const {
    for (int j = dof - 1; j >= 0; --j) {
      to[j] = q[j] + TURN * (low[j] + static_cast<int>(node % count[j]));
      node /= count[j];
    }
  }
};

// One layer while it is the front of the search.
struct Front {
  long sample = -1;
  std::vector<Windings> windings;   // of each row
  std::vector<long> first;          // its first node
  std::vector<std::int32_t> breaks;  // of each node; NEVER where there is no way to it
  std::vector<double> cost;
  long best = -1;  // the node with fewest breaks, of those the cheapest

  bool better(std::int32_t b, double c, long node) const {
    return b < breaks[node] || (b == breaks[node] && c < cost[node]);
  }
  void choose_best() {
    best = -1;
    for (long k = 0; k < static_cast<long>(breaks.size()); ++k)
      if (breaks[k] != NEVER && (best < 0 || better(breaks[k], cost[k], best))) best = k;
  }
};

class Search {
 public:
  explicit Search(const PathLayers& in) : in_(in), dof_(in.step.dof), kernels_(active_kernels()) {
    const long samples = in.samples;
    out_.q.assign(static_cast<size_t>(samples) * dof_, std::numeric_limits<double>::quiet_NaN());
    out_.row.assign(samples, -1);
    out_.linked.assign(samples, 0);
    out_.level.assign(samples, 0);
    out_.reached_start.push_back(0);
    via_start_.assign(samples + 1, 0);
    live_.assign(samples, 0);
  }

  PathChoice run() {
    for (long i = 0; i < in_.samples; ++i) {
      open_layer(i);
      if (here_.first.back() > 0) {
        if (last_.sample < 0)
          begin();
        else
          extend();
        here_.choose_best();
      }
      via_start_[i + 1] = static_cast<std::int64_t>(via_.size());
      live_[i] = here_.best >= 0;
      if (here_.best >= 0) {
        if (last_.sample == i - 1 && i > 0 && here_.breaks[here_.best] > last_.breaks[last_.best]) note_barrier();
        std::swap(here_, last_);
      }
      out_.level[i] = last_.sample < 0 ? 0 : last_.breaks[last_.best];
    }
    if (last_.sample >= 0) trace_back();
    return std::move(out_);
  }

 private:
  const double* row_of(const Front& front, long row) const { return in_.q + (in_.start[front.sample] + row) * dof_; }
  Windings windings_of(std::int64_t row) const {
    return {in_.q + row * dof_, dof_, in_.fixed[row] ? no_turns_ : in_.step.turns, in_.lower, in_.upper};
  }

  void open_layer(long sample) {
    const long rows = static_cast<long>(in_.start[sample + 1] - in_.start[sample]);
    here_.sample = sample;
    here_.best = -1;
    here_.windings.clear();
    here_.first.assign(1, 0);
    for (long r = 0; r < rows; ++r) {
      here_.windings.push_back(windings_of(in_.start[sample] + r));
      here_.first.push_back(here_.first.back() + here_.windings.back().nodes);
    }
    const long nodes = here_.first.back();
    if (nodes >= MOST_NODES) throw std::length_error("too many windings in one layer");
    here_.breaks.assign(nodes, NEVER);
    here_.cost.assign(nodes, 0.0);
    via_.resize(via_.size() + nodes, FIRST);
  }

  std::uint32_t& via(long node) { return via_[via_.size() - here_.breaks.size() + node]; }

  // The first layer with nodes. Where the arm is may be one of them, or within a step of some: then the
  // path begins there.
  void begin() {
    bool any_near = false;
    std::vector<std::uint8_t> near(here_.breaks.size(), 0);
    double value[MAX_JOINTS];
    for (size_t r = 0; r < here_.windings.size(); ++r)
      for (long k = here_.first[r]; k < here_.first[r + 1]; ++k) {
        here_.breaks[k] = 0;
        if (!in_.before) continue;
        here_.windings[r].write(row_of(here_, r), dof_, k - here_.first[r], value);
        double size = 0.0;
        bool within = true;
        for (int j = 0; j < dof_; ++j) {
          const double d = std::fabs(value[j] - in_.before[j]), w = d * in_.step.weight[j];
          within &= d <= in_.step.limit[j];
          size = in_.step.squares ? size + w * w : std::max(size, w);
        }
        here_.cost[k] = in_.step.squares ? std::sqrt(size) : size;
        near[k] = within;
        any_near |= within;
      }
    if (any_near)
      for (size_t k = 0; k < near.size(); ++k)
        if (!near[k]) here_.breaks[k] = NEVER;
  }

  void extend() {
    if (last_.sample == here_.sample - 1) step();
    const std::int32_t breaks = last_.breaks[last_.best] + 1;
    const double cost = last_.cost[last_.best];
    for (long k = 0; k < here_.first.back(); ++k)
      if (here_.better(breaks, cost, k)) {
        here_.breaks[k] = breaks;
        here_.cost[k] = cost;
        via(k) = static_cast<std::uint32_t>(last_.best) | JUMPED;
      }
  }

  // All steps from the last layer into this one.
  void step() {
    const long froms = static_cast<long>(last_.windings.size()), tos = static_cast<long>(here_.windings.size());
    const long stride = (froms + WIDEST - 1) / WIDEST * WIDEST;
    columns_.assign(static_cast<size_t>(dof_) * stride, 0.0);
    for (long a = 0; a < froms; ++a)
      for (int j = 0; j < dof_; ++j) columns_[j * stride + a] = row_of(last_, a)[j];
    steps_.resize(static_cast<size_t>(tos) * stride);
    kernels_.joint_steps(in_.step, columns_.data(), froms, stride, row_of(here_, 0), tos, steps_.data());
    for (long b = 0; b < tos; ++b)
      for (long a = 0; a < froms; ++a) {
        const double size = steps_[b * stride + a];
        if (size < std::numeric_limits<double>::infinity() && may_join(a, b)) join(a, b, size);
      }
  }

  bool may_join(long a, long b) const {
    const std::int64_t from = in_.start[last_.sample] + a, to = in_.start[here_.sample] + b;
    const std::int32_t s = in_.side[from], t = in_.side[to];
    if (s == t || s < 0 || t < 0) return true;
    const std::int64_t* end = in_.open_to + in_.open;
    auto [low, high] = std::equal_range(in_.open_to, end, to);
    return std::binary_search(in_.open_from + (low - in_.open_to), in_.open_from + (high - in_.open_to), from);
  }

  // A step between rows a and b, for each winding of b that has one of a within reach.
  void join(long a, long b, double size) {
    const Windings &wa = last_.windings[a], &wb = here_.windings[b];
    const double *qa = row_of(last_, a), *qb = row_of(here_, b);
    int extent[MAX_JOINTS], at[MAX_JOINTS];
    long from[MAX_JOINTS], to[MAX_JOINTS], stride_a = 1, stride_b = 1, na = last_.first[a], nb = here_.first[b];
    for (int j = dof_ - 1; j >= 0; --j) {
      const int shift = in_.step.turns[j] ? static_cast<int>(std::nearbyint((qb[j] - qa[j]) / TURN)) : 0;
      const int low = std::max(wb.low[j], wa.low[j] - shift);
      const int high = std::min(wb.low[j] + wb.count[j], wa.low[j] + wa.count[j] - shift);
      if (low >= high) return;
      extent[j] = high - low;
      at[j] = 0;
      na += (low + shift - wa.low[j]) * stride_a;
      nb += (low - wb.low[j]) * stride_b;
      from[j] = stride_a;
      to[j] = stride_b;
      stride_a *= wa.count[j];
      stride_b *= wb.count[j];
    }
    int j = 0;
    do {
      const std::int32_t breaks = last_.breaks[na];
      const double cost = last_.cost[na] + size;
      if (breaks != NEVER && here_.better(breaks, cost, nb)) {
        here_.breaks[nb] = breaks;
        here_.cost[nb] = cost;
        via(nb) = static_cast<std::uint32_t>(na);
      }
      // the next of the windings that both have, the last joint's fastest
      for (j = dof_ - 1; j >= 0; --j) {
        if (++at[j] < extent[j]) {
          na += from[j];
          nb += to[j];
          break;
        }
        na -= (extent[j] - 1) * from[j];
        nb -= (extent[j] - 1) * to[j];
        at[j] = 0;
      }
    } while (j >= 0);
  }

  void note_barrier() {
    out_.barrier.push_back(last_.sample);
    const std::int32_t least = last_.breaks[last_.best];
    for (size_t r = 0; r < last_.windings.size(); ++r)
      for (long k = last_.first[r]; k < last_.first[r + 1]; ++k) {
        if (last_.breaks[k] != least) continue;
        out_.reached_row.push_back(in_.start[last_.sample] + static_cast<long>(r));
        out_.reached_q.resize(out_.reached_q.size() + dof_);
        last_.windings[r].write(row_of(last_, r), dof_, k - last_.first[r],
                                out_.reached_q.data() + out_.reached_q.size() - dof_);
      }
    out_.reached_start.push_back(static_cast<std::int64_t>(out_.reached_row.size()));
  }

  void trace_back() {
    out_.cost = last_.cost[last_.best];
    long node = last_.best;
    for (long i = last_.sample; i >= 0; --i) {
      if (!live_[i]) continue;
      long left = node;
      std::int64_t row = in_.start[i];
      Windings windings = windings_of(row);
      while (left >= windings.nodes) {
        left -= windings.nodes;
        windings = windings_of(++row);
      }
      out_.row[i] = row;
      windings.write(in_.q + row * dof_, dof_, left, out_.q.data() + i * dof_);
      const std::uint32_t via = via_[via_start_[i] + node];
      if (via == FIRST) return;
      out_.linked[i] = !(via & JUMPED);
      node = static_cast<long>(via & ~JUMPED);
    }
  }

  const PathLayers& in_;
  const int dof_;
  const Kernels& kernels_;
  const std::uint8_t no_turns_[MAX_JOINTS] = {};
  PathChoice out_;
  Front here_, last_;
  std::vector<std::uint32_t> via_;  // of all nodes: the one before, in its own layer
  std::vector<std::int64_t> via_start_;
  std::vector<std::uint8_t> live_;  // which layers have nodes
  std::vector<double> columns_, steps_;
};

}  // namespace

std::vector<std::int64_t> winding_counts(const double* q, long rows, int dof, const std::uint8_t* turns,
                                         const double* lower, const double* upper) {
  std::vector<std::int64_t> counts(static_cast<size_t>(rows));
  for (long r = 0; r < rows; ++r) counts[r] = Windings(q + r * dof, dof, turns, lower, upper).nodes;
  return counts;
}

void write_windings(const double* q, long rows, int dof, const std::uint8_t* turns, const double* lower,
                    const double* upper, double* to) {
  for (long r = 0; r < rows; ++r) {
    const Windings windings(q + r * dof, dof, turns, lower, upper);
    for (long k = 0; k < windings.nodes; ++k, to += dof) windings.write(q + r * dof, dof, k, to);
  }
}

PathChoice shortest_path(const PathLayers& layers) { return Search(layers).run(); }

}  // namespace kinverse
