// Six joints of which two slide: what their closed form needs to know, found once per arm.
#pragma once

namespace kinverse {

// The arm and the pose close a loop: joint, link, joint, link, ..., joint, pose. It is walked from a
// turning joint on, the driver, in whose angle the final polynomial is written.
struct SlidePair {
  int joint[6];       // which moving joint of the chain stands at each place
  bool prismatic[6];
  double link[6][12]; // behind the joint at each place, 3x4 in units of the arm's size
  int pose_link;      // the place behind which the pose stands:  before * T^-1 * after
  double before[12], after[12];
};

}  // namespace kinverse
