// Compiled once per instruction set, like kernels.cpp.
#include "least_squares.hpp"

#include "kernels.hpp"

namespace kinverse::KINVERSE_ISA {

void least_squares_lanes(const LeastSquaresProblem& problem, const LeastSquaresInput& in, long count,
                         const LeastSquaresOutput& out) {
  least_squares<LANES>(problem, in, count, out);
}

}  // namespace kinverse::KINVERSE_ISA
