#include "general_6r_setup.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "random.hpp"

namespace kinverse {
namespace {

constexpr double TWO_PI = 6.28318530717958647693;

using Link = std::array<double, 12>;

Link product(const Link& a, const Link& b) {
  Link c{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) {
      double sum = j == 3 ? a[4 * i + 3] : 0.0;
      for (int k = 0; k < 3; ++k) sum += a[4 * i + k] * b[4 * k + j];
      c[4 * i + j] = sum;
    }
  return c;
}
Link inverse(const Link& a) {
  Link c{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) c[4 * i + j] = a[4 * j + i];
    c[4 * i + 3] = -(a[i] * a[3] + a[4 + i] * a[7] + a[8 + i] * a[11]);
  }
  return c;
}
Link turn_z(double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0};
}
// the counterpart of joint_motion in general_6r_kernel.hpp
Link motion(bool prismatic, double v) {
  return prismatic ? Link{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, v} : turn_z(v);
}

Link disturbed(const Link& link, double by, Random& random) {
  if (by == 0.0) return link;
  const double w[3] = {random.uniform(-by, by), random.uniform(-by, by), random.uniform(-by, by)};
  const double angle = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  const double s = std::sin(angle) / angle, c = (1.0 - std::cos(angle)) / (angle * angle);
  const double hat[3][3] = {{0, -w[2], w[1]}, {w[2], 0, -w[0]}, {-w[1], w[0], 0}};
  Link m{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      double square = 0.0;
      for (int k = 0; k < 3; ++k) square += hat[i][k] * hat[k][j];
      m[4 * i + j] = (i == j) + s * hat[i][j] + c * square;
    }
    m[4 * i + 3] = random.uniform(-by, by);
  }
  return product(link, m);
}

// What a joint's values at three points make of the three functions of its basis.
struct Basis {
  double point[3];
  double to_coefficients[3][3];  // [function][point]
  double power[3][3];            // [function][falling power] of the half-angle, over a common denominator
};
Basis basis(bool prismatic) {
  Basis b;
  double value[3][3];  // [point][function]
  for (int i = 0; i < 3; ++i) {
    const double v = b.point[i] = prismatic ? i - 1.0 : TWO_PI * i / 3.0;
    value[i][0] = prismatic ? v * v : std::cos(v);
    value[i][1] = prismatic ? v : std::sin(v);
    value[i][2] = 1.0;
  }
  auto minor = [&](int r, int c) {
    const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
    return value[r1][c1] * value[r2][c2] - value[r1][c2] * value[r2][c1];
  };
  const double determinant = value[0][0] * minor(0, 0) + value[0][1] * minor(0, 1) + value[0][2] * minor(0, 2);
  for (int f = 0; f < 3; ++f)
    for (int i = 0; i < 3; ++i) b.to_coefficients[f][i] = minor(i, f) / determinant;
  const double turn[3][3] = {{-1, 0, 1}, {0, 2, 0}, {1, 0, 1}};
  const double slide[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int f = 0; f < 3; ++f)
    for (int k = 0; k < 3; ++k) b.power[f][k] = prismatic ? slide[f][k] : turn[f][k];
  return b;
}

void invariants(const double* p, const double* l, double* f) {
  double pp = 0.0, pl = 0.0;
  for (int k = 0; k < 3; ++k) pp += p[k] * p[k], pl += p[k] * l[k];
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    f[k] = p[k];
    f[3 + k] = l[k];
    f[8 + k] = p[i] * l[j] - p[j] * l[i];
    f[11 + k] = pp * l[k] - 2.0 * pl * p[k];
  }
  f[6] = pp;
  f[7] = pl;
}

// The left side of the 14 equations as products of a's and b's functions, and what takes it away.
bool remove_left(Elimination& e, const Basis& a, const Basis& b) {
  constexpr int N = INVARIANTS;
  double left[N][9] = {};
  Link link_f, link_a;
  std::copy_n(e.link[F], 12, link_f.begin());
  std::copy_n(e.link[A], 12, link_a.begin());
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      Link m = product(inverse(motion(e.prismatic[A], a.point[i])), inverse(link_f));
      m = product(inverse(motion(e.prismatic[B], b.point[j])), product(inverse(link_a), m));
      const double p[3] = {m[3], m[7], m[11]}, l[3] = {m[2], m[6], m[10]};
      double f[N];
      invariants(p, l, f);
      for (int r = 0; r < N; ++r)
        for (int fa = 0; fa < 3; ++fa)
          for (int fb = 0; fb < 3; ++fb)
            left[r][3 * fa + fb] += f[r] * a.to_coefficients[fa][i] * b.to_coefficients[fb][j];
    }
  // Householder: Q^T left = [R; 0]
  double q[N][N] = {};
  for (int r = 0; r < N; ++r) q[r][r] = 1.0;
  double m[N][8];
  for (int r = 0; r < N; ++r) std::copy_n(left[r], 8, m[r]);
  double smallest = 1e300, largest = 0.0;
  for (int j = 0; j < 8; ++j) {
    double n2 = 0.0;
    for (int r = j; r < N; ++r) n2 += m[r][j] * m[r][j];
    const double n = std::sqrt(n2), diagonal = m[j][j] > 0.0 ? -n : n;
    smallest = std::min(smallest, n);
    largest = std::max(largest, n);
    if (n == 0.0) return false;
    double v[N] = {};
    for (int r = j; r < N; ++r) v[r] = m[r][j];
    v[j] -= diagonal;
    const double beta = 1.0 / (n2 - diagonal * m[j][j]);
    auto reflect = [&](auto& matrix, int columns) {
      for (int k = 0; k < columns; ++k) {
        double w = 0.0;
        for (int r = j; r < N; ++r) w += v[r] * matrix[r][k];
        for (int r = j; r < N; ++r) matrix[r][k] -= beta * w * v[r];
      }
    };
    reflect(m, 8);
    reflect(q, N);
  }
  if (smallest < 1e-10 * largest) return false;
  for (int r = 0; r < 6; ++r) std::copy_n(q[8 + r], N, e.annihilate[r]);
  for (int r = 7; r >= 0; --r)
    for (int k = 0; k < N; ++k) {
      double sum = q[r][k];
      for (int i = r + 1; i < 8; ++i) sum -= m[r][i] * e.recover[i][k];
      e.recover[r][k] = sum / m[r][r];
    }
  auto constant = [&](const double* row) {
    double sum = 0.0;
    for (int k = 0; k < N; ++k) sum += row[k] * left[k][8];
    return sum;
  };
  for (int r = 0; r < 6; ++r) e.annihilate_constant[r] = constant(e.annihilate[r]);
  for (int r = 0; r < 8; ++r) e.recover_constant[r] = constant(e.recover[r]);
  return true;
}

void tabulate(Elimination& e, const Basis (&right)[3]) {
  for (int s = 0; s < PADDED_SAMPLES; ++s) {
    const int used = std::min(s, SAMPLES - 1), index[3] = {used / 9, used / 3 % 3, used % 3};
    for (int joint = 0; joint < 3; ++joint) {
      const Link m = motion(e.prismatic[C + joint], right[joint].point[index[joint]]);
      for (int k = 0; k < 12; ++k) e.motion[joint][k][s] = m[k];
    }
    if (s >= SAMPLES) continue;
    // [basis of c][power of d][power of e]
    double to_power[2][3];
    for (int joint = 1; joint < 3; ++joint)
      for (int power = 0; power < 3; ++power) {
        double sum = 0.0;
        for (int f = 0; f < 3; ++f) sum += right[joint].power[f][power] * right[joint].to_coefficients[f][index[joint]];
        to_power[joint - 1][power] = sum;
      }
    for (int k = 0; k < PADDED_SAMPLES; ++k) e.to_coefficients[s][k] = 0.0;
    for (int f = 0; f < 3; ++f)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          e.to_coefficients[s][9 * f + 3 * i + j] = right[0].to_coefficients[f][index[0]] * to_power[0][i] * to_power[1][j];
  }
}

}  // namespace

double arm_size(const Chain& chain) {
  double size = 0.0;
  for (int i = 0; i <= chain.joints; ++i) {
    const double* m = chain.frames + 12 * i;
    size += std::sqrt(m[3] * m[3] + m[7] * m[7] + m[11] * m[11]);
  }
  return size > 0.0 ? size : 1.0;
}

bool make_elimination(const Chain& chain, double size, int loop, double disturbance, unsigned trial, Elimination& e) {
  const bool backwards = loop >= 4;
  const int pose_place = B + loop % 4;
  Random random(0x5eed + trial);
  // the loop from its first joint on: joints and the links behind them; the last one holds the pose
  Link frames[7], walk[6], before, after;
  for (int i = 0; i < 7; ++i) {
    std::copy_n(chain.frames + 12 * i, 12, frames[i].begin());
    for (int k = 3; k < 12; k += 4) frames[i][static_cast<size_t>(k)] /= size;
    frames[i] = disturbed(frames[i], disturbance, random);
  }
  int joint[6];
  for (int i = 0; i < 6; ++i) joint[i] = backwards ? 5 - i : i;
  for (int i = 0; i < 5; ++i) walk[i] = backwards ? inverse(frames[5 - i]) : frames[i + 1];
  before = backwards ? inverse(frames[0]) : frames[6];
  after = backwards ? inverse(frames[6]) : frames[0];
  e.pose_inverted = !backwards;
  e.pose_link = pose_place;
  e.sign = backwards ? -1.0 : 1.0;
  e.disturbance = disturbance;
  Link links[6];
  for (int place = 0; place < 6; ++place) {
    const int at = (place - pose_place + 5 + 6) % 6;
    e.joint[place] = joint[at];
    e.prismatic[place] = chain.prismatic[joint[at]] != 0;
    links[place] = at == 5 ? Link{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0} : walk[at];
    e.shift[place] = 0.0;
  }
  if (e.prismatic[F] || e.prismatic[C]) return false;
  // half-angles of d and e are counted from a place where no arm likes to stand
  for (int place : {int(D), int(E)}) {
    if (e.prismatic[place]) continue;
    e.shift[place] = place == D ? 0.731 : 1.217;
    const Link back = turn_z(-e.shift[place]);
    if (place == pose_place)
      before = product(back, before);
    else
      links[place] = product(back, links[place]);
  }
  for (int place = 0; place < 6; ++place) std::copy_n(links[place].begin(), 12, e.link[place]);
  std::copy_n(before.begin(), 12, e.before);
  std::copy_n(after.begin(), 12, e.after);
  const Basis right[3] = {basis(false), basis(e.prismatic[D]), basis(e.prismatic[E])};
  tabulate(e, right);
  return remove_left(e, basis(e.prismatic[A]), basis(e.prismatic[B]));
}

std::vector<SlidePair> make_slide_pairs(const Chain& chain, double size) {
  // sine of the angle between neighbouring turning axes below which one does not tell the other's angle
  constexpr double PARALLEL = 1e-6;
  std::vector<SlidePair> pairs;
  for (int driver = 0; driver < 6; ++driver) {
    if (chain.prismatic[driver]) continue;
    SlidePair pair{};
    int turns = 0;
    bool is_usable = true;
    Link gap{};
    for (int place = 0; place < 6; ++place) {
      const int j = (driver + place) % 6;
      pair.joint[place] = j;
      pair.prismatic[place] = chain.prismatic[j] != 0;
      // joint 2 of the four-bar follows from the angles to its neighbours; where the pose stands
      // between, the angle is another each time
      if (!pair.prismatic[place]) {
        if (turns >= 2 && std::hypot(gap[2], gap[6]) < PARALLEL) is_usable = false;
        gap = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
        ++turns;
      }
      Link link;
      std::copy_n(chain.frames + 12 * (j + 1), 12, link.begin());
      for (int k = 3; k < 12; k += 4) link[static_cast<size_t>(k)] /= size;
      std::copy_n(link.begin(), 12, pair.link[place]);
      gap = product(gap, link);
      if (j < 5) continue;
      pair.pose_link = place;
      std::copy_n(link.begin(), 12, pair.before);
      std::copy_n(chain.frames, 12, pair.after);
      for (int k = 3; k < 12; k += 4) pair.after[k] /= size;
      gap = {1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1, 0};  // no angle at all
    }
    if (is_usable) pairs.push_back(pair);
  }
  return pairs;
}

const TrigTables& trig_tables() {
  static const TrigTables tables = [] {
    TrigTables t;
    for (int i = 0; i < TRIG_SAMPLES; ++i) {
      const double angle = TWO_PI * i / TRIG_SAMPLES + 0.1;
      t.c[i] = std::cos(angle);
      t.s[i] = std::sin(angle);
      for (int k = 0; k < TRIG_SAMPLES / 2; ++k) {
        t.re[k][i] = std::cos(k * angle) / TRIG_SAMPLES;
        t.im[k][i] = -std::sin(k * angle) / TRIG_SAMPLES;
      }
    }
    return t;
  }();
  return tables;
}

}  // namespace kinverse
