// Compiled once per instruction set; everything here lives in a namespace named by it.
#include "kernels.hpp"

#include "kinematics.hpp"

namespace kinverse::KINVERSE_ISA {
namespace {

// Rows of joint values, lane l from configuration first + l; the tail repeats the last one, so that
// every configuration goes through the same instructions.
template <int W>
KINVERSE_INLINE void gather_joints(const double* q, int dof, long first, long count, Pack<W>* out) {
  alignas(64) double t[W];
  for (int j = 0; j < dof; ++j) {
    for (int l = 0; l < W; ++l) {
      long row = first + l < count ? first + l : count - 1;
      t[l] = q[row * dof + j];
    }
    out[j] = load<W>(t);
  }
}

template <int W>
void forward_batch(const Chain& chain, const double* q, long count, double* T) {
  for (long first = 0; first < count; first += W) {
    Pack<W> joints[MAX_JOINTS];
    gather_joints<W>(q, chain.dof, first, count, joints);
    Frame<Pack<W>> f = forward<W>(chain, joints);
    alignas(64) double t[12][W];
    const Vec3<Pack<W>> columns[4] = {f.x, f.y, f.z, f.p};
    for (int k = 0; k < 4; ++k) {
      store(t[k], columns[k].x);
      store(t[4 + k], columns[k].y);
      store(t[8 + k], columns[k].z);
    }
    long lanes = count - first < W ? count - first : W;
    for (long l = 0; l < lanes; ++l) {
      double* row = T + 16 * (first + l);
      for (int k = 0; k < 12; ++k) row[k] = t[k][l];
      row[12] = row[13] = row[14] = 0.0;
      row[15] = 1.0;
    }
  }
}

template <int W>
void jacobian_batch(const Chain& chain, const double* q, long count, double* J) {
  for (long first = 0; first < count; first += W) {
    Pack<W> joints[MAX_JOINTS], columns[MAX_JOINTS][6];
    gather_joints<W>(q, chain.dof, first, count, joints);
    forward<W>(chain, joints, columns);
    long lanes = count - first < W ? count - first : W;
    for (int j = 0; j < chain.dof; ++j)
      for (int k = 0; k < 6; ++k) {
        alignas(64) double t[W];
        store(t, columns[j][k]);
        for (long l = 0; l < lanes; ++l) J[((first + l) * 6 + k) * chain.dof + j] = t[l];
      }
  }
}

}  // namespace

#define KINVERSE_TEXT_OF(x) #x
#define KINVERSE_TEXT(x) KINVERSE_TEXT_OF(x)

const Kernels KERNELS = {
    KINVERSE_TEXT(KINVERSE_ISA), LANES, forward_batch<LANES>, forward_batch<1>, jacobian_batch<LANES>,
};

}  // namespace kinverse::KINVERSE_ISA
