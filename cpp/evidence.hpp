// What the answer of a pose rests on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

namespace kinverse {

// search: nothing is known of what it did not find. sweep: a search over a free parameter. closed_form,
// elimination: every solution. bounds: intervals or lengths that show that there is none.
enum class Ground : std::uint8_t { search, sweep, closed_form, elimination, bounds };

// One row of the array that Python sees (evidence_type in bindings.cpp).
struct Evidence {
  double root_gap = std::numeric_limits<double>::quiet_NaN();
  double root_margin = std::numeric_limits<double>::quiet_NaN();
  std::int32_t real_roots = -1, complex_roots = -1;
  Ground method = Ground::search;
  bool weak = true;  // solutions may be missing
};
constexpr std::size_t EVIDENCE_BYTES = 26;  // without the padding behind them, which is not always the same
static_assert(offsetof(Evidence, weak) + 1 == EVIDENCE_BYTES);

}  // namespace kinverse
