// The cheapest sequence of joint values through layers of them, one layer a sample of a path.
#pragma once

#include <cstdint>
#include <vector>

#include "dispatch.hpp"

namespace kinverse {

// Layer i holds the rows start[i] .. start[i+1]-1 of q (rows, dof). A row stands for all of its
// windings inside the limits, or, if it is fixed, for itself: these are its nodes.
struct PathLayers {
  StepSpec step;
  long samples;
  const std::int64_t* start;  // samples + 1
  const double* q;
  const std::uint8_t* fixed;
  const std::int32_t* side;    // a step joins equal sides only; below zero: any
  const double *lower, *upper;  // dof
  const double* before;        // (dof) where the arm is, or null
  // pairs of rows that a step may join although their sides differ, ascending by `to`, then by `from`
  long open;
  const std::int64_t *open_from, *open_to;
};

// What came out: as few breaks as can be, and of those ways the cheapest.
struct PathChoice {
  std::vector<double> q;              // (samples, dof), not a number in a layer without nodes
  std::vector<std::int64_t> row;      // (samples), -1 likewise
  std::vector<std::uint8_t> linked;   // (samples) a step leads here from the sample before
  std::vector<std::int32_t> level;    // (samples) fewest breaks up to here
  double cost = 0.0;
  // Barriers: samples behind which every way breaks that has not more breaks up to there; and of each
  // the nodes that such ways reach: their rows and joint values.
  std::vector<std::int64_t> barrier, reached_start, reached_row;
  std::vector<double> reached_q;
};

// Number of nodes of each row.
std::vector<std::int64_t> winding_counts(const double* q, long rows, int dof, const std::uint8_t* turns,
                                         const double* lower, const double* upper);
// Joint values of all nodes, one after the other.
void write_windings(const double* q, long rows, int dof, const std::uint8_t* turns, const double* lower,
                    const double* upper, double* to);

PathChoice shortest_path(const PathLayers& layers);

}  // namespace kinverse
