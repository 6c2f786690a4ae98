// The eliminations of one six-joint arm, built from its chain.
#pragma once

#include "general_6r_spec.hpp"
#include "owned_chain.hpp"

namespace kinverse {

constexpr int LOOPS = 8;  // places where the pose can stand, times two directions

// One elimination of an arm with at most one slide. `loop` numbers where the pose stands and the direction; `disturbance` moves every
// link at random by so much of the arm's size and of a radian, which parts the coincidences of
// specially built arms; `trial` picks the random numbers. False: joints f or c slide, or the
// equations for a and b are dependent.
bool make_elimination(const Chain& chain, double size, int loop, double disturbance, unsigned trial, Elimination& e);

// The eliminations of an arm with two slides, one for each joint that can drive.
std::vector<SlidePair> make_slide_pairs(const Chain& chain, double size);

double arm_size(const Chain& chain);
const TrigTables& trig_tables();

}  // namespace kinverse
