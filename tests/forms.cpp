/// \file
/// Written out step by step in float. What is summed is kept as factors, so that a sum can be fused.
#include "tests/forms.hpp"

#include "oracle/checks/comparison.hpp"
#include "oracle/checks/field_checks.hpp"
#include "reference/neighbors.hpp"
#include "reference/pose.hpp"
#include "reference/solver.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#ifdef __SSE2__
#include <xmmintrin.h>
#endif

namespace decant::test {
namespace {

using F3 = std::array<float, 3>;
using Term = std::array<float, 2>;  // a product

F3 float3(const Vec3& v) { return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])}; }
F3 operator+(F3 a, F3 b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
F3 operator-(F3 a, F3 b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
F3 operator*(float s, F3 a) { return {s * a[0], s * a[1], s * a[2]}; }
F3 cross(F3 a, F3 b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }

class Evaluator {
 public:
  Evaluator(const Forms& forms, const Scene& scene) : f(forms), scene_(scene) {
    const float pi = std::numbers::pi_v<float>;
    const FluidProperties& fluid = scene.fluid;
    const bool mueller = scene.kernel == KernelFamily::mueller2003;
    const bool cubic = scene.kernel == KernelFamily::cubic_spline;
    rho0 = static_cast<float>(fluid.rest_density);
    mu = static_cast<float>(fluid.viscosity);
    mu_w = static_cast<float>(fluid.wall_viscosity);
    gamma = static_cast<float>(fluid.eos_exponent);
    if (f.constants == Forms::Constant::formed) {
      const float dx = static_cast<float>(scene.particle_spacing), c0 = static_cast<float>(fluid.sound_speed);
      H = static_cast<float>(scene.support_ratio) * dx;
      h = 0.5f * H;
      m = static_cast<float>(scene.mass_ratio) * rho0 * dx * dx * dx;
      B = rho0 * c0 * c0 / gamma;
      const float h3 = h * h * h, h5 = h * h * h * h * h;
      float H9 = 1, H6 = 1;
      for (int k = 0; k < 9; ++k) H9 *= H;
      for (int k = 0; k < 6; ++k) H6 *= H;
      w = mueller ? 315.0f / (64.0f * pi * H9) : (cubic ? 1.0f : 21.0f / 16.0f) / (pi * h3);
      g = mueller ? 45.0f / (pi * H6) : (cubic ? 1.0f : 105.0f / 16.0f) / (pi * h5);
    } else {
      const double pi2 = std::numbers::pi, Hd = scene.support_radius(), hd = 0.5 * Hd;
      H = static_cast<float>(Hd);
      h = static_cast<float>(hd);
      m = static_cast<float>(scene.particle_mass());
      B = static_cast<float>(scene.eos_stiffness());
      w = static_cast<float>(mueller ? 315 / (64 * pi2 * std::pow(Hd, 9))
                                     : (cubic ? 1.0 : 21.0 / 16) / (pi2 * std::pow(hd, 3)));
      g = static_cast<float>(mueller ? 45 / (pi2 * std::pow(Hd, 6))
                                     : (cubic ? 1.0 : 105.0 / 16) / (pi2 * std::pow(hd, 5)));
    }
    inverse_h = 1.0f / h;
    inverse_rho0 = 1.0f / rho0;
    cell_ = std::exp2(std::ceil(std::log2(H)));
    for (int a = 0; a < 3; ++a) {
      const double low = scene.domain.min[a], high = scene.domain.max[a];
      periodic_[a] = scene.domain.periodic[static_cast<std::size_t>(a)];
      L_[a] = f.constants == Forms::Constant::formed ? static_cast<float>(high) - static_cast<float>(low)
                                                     : static_cast<float>(high - low);
    }
  }

  F3 difference(F3 a, F3 b) const {
    F3 d;
    for (std::size_t c = 0; c < 3; ++c) {
      float shift = 0;
      if (periodic_[c]) shift = std::round((a[c] - b[c]) / L_[c]) * L_[c];
      if (shift != 0 && f.image == Forms::Image::ghost) {
        const float ghost = b[c] + shift;
        d[c] = a[c] - ghost;
      } else if (f.frame == Forms::Frame::cell) {
        const float center_a = (std::floor(a[c] / cell_) + 0.5f) * cell_,
                    center_b = (std::floor(b[c] / cell_) + 0.5f) * cell_;
        d[c] = ((a[c] - center_a) - (b[c] - center_b)) + (center_a - center_b);
        d[c] -= shift;
      } else {
        d[c] = a[c] - b[c];
        d[c] -= shift;
      }
    }
    return d;
  }
  float square(F3 d) const {
    if (f.fused) return std::fma(d[2], d[2], std::fma(d[1], d[1], d[0] * d[0]));
    return d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
  }
  float length(float r2) const {
    if (f.root == Forms::Root::root) return std::sqrt(r2);
    return r2 > 0 ? r2 * (1.0f / std::sqrt(r2)) : 0.0f;
  }
  float q_of(float r) const { return f.quotient == Forms::Quotient::by_inverse ? r * inverse_h : r / h; }

  float W(float r2) const {
    const float q = q_of(length(r2));
    switch (scene_.kernel) {
      case KernelFamily::cubic_spline: {
        const float s = 2.0f - q;
        const float outer = 0.25f * (s * s * s);
        if (q >= 1) return w * outer;
        if (f.polynomial == Forms::Polynomial::factored) {
          const float t = 1.0f - q;
          return w * (outer - t * t * t);
        }
        if (f.polynomial == Forms::Polynomial::monomials) return w * (1.0f - 1.5f * q * q + 0.75f * q * q * q);
        return w * (f.fused ? std::fma(q * q, std::fma(0.75f, q, -1.5f), 1.0f) : 1.0f + q * q * (0.75f * q - 1.5f));
      }
      case KernelFamily::wendland_c2: {
        if (f.polynomial == Forms::Polynomial::factored) {
          const float s = 0.5f * (2.0f - q);
          return w * (s * s) * (s * s) * (2.0f * q + 1.0f);
        }
        const float s = 1.0f - 0.5f * q;
        return w * s * s * s * s * (1.0f + 2.0f * q);
      }
      case KernelFamily::mueller2003:
        break;
    }
    if (f.polynomial == Forms::Polynomial::factored) {
      const float q2 = r2 / (H * H), s = 1.0f - q2, H6 = H * H * H * H * H * H;
      return w * H6 * s * s * s;
    }
    const float s = H * H - r2;
    return w * s * s * s;
  }
  float G(float r2) const {
    const float r = length(r2), q = q_of(r);
    switch (scene_.kernel) {
      case KernelFamily::cubic_spline: {
        if (q < 1) return g * (3.0f - 2.25f * q);
        const float s = 2.0f - q;
        return f.quotient == Forms::Quotient::by_inverse ? (0.75f * g * h) * (1.0f / r) * (s * s)
                                                         : g * 0.75f * s * s / q;
      }
      case KernelFamily::wendland_c2: {
        const float s = 1.0f - 0.5f * q;
        return g * s * s * s;
      }
      case KernelFamily::mueller2003:
        break;
    }
    if (!(r > 0)) return 0;
    const float s = H - r;
    return f.quotient == Forms::Quotient::by_inverse ? g * s * s * (1.0f / r) : g * (s * s) / r;
  }
  float viscous(float r2, float G_at) const {
    if (scene_.kernel == KernelFamily::mueller2003) return g * (H - length(r2));
    const float soft = 0.01f * h * h;
    if (f.polynomial == Forms::Polynomial::factored) {
      const float r = length(r2);
      return 2.0f * r * (r * G_at) / (r2 + soft);
    }
    return 2.0f * r2 * G_at / (r2 + soft);
  }
  float pressure(float rho) const {
    const float s = f.quotient == Forms::Quotient::by_inverse ? rho * inverse_rho0 : rho / rho0;
    float power = s;
    if (f.power == Forms::Power::pow) {
      power = std::pow(s, gamma);
    } else if (gamma == 7) {
      const float s2 = s * s;
      power = s2 * s2 * s2 * s;
    }
    const float p = f.polynomial == Forms::Polynomial::monomials ? B * power - B : B * (power - 1.0f);
    return scene_.fluid.allow_tension ? p : std::max(p, 0.0f);
  }
  float q_pressure(float p, float rho) const {
    if (f.quotient == Forms::Quotient::divided) return p / (rho * rho);
    const float inverse = 1.0f / rho;
    return p * inverse * inverse;
  }

  float total(std::vector<Term>& terms, float start) {
    const auto size = [](const Term& t) { return std::abs(t[0] * t[1]); };
    if (f.order == Forms::Order::random) std::shuffle(terms.begin(), terms.end(), random_);
    if (f.order == Forms::Order::smallest_first || f.order == Forms::Order::largest_first)
      std::stable_sort(terms.begin(), terms.end(), [&](const Term& a, const Term& b) {
        return f.order == Forms::Order::smallest_first ? size(a) < size(b) : size(a) > size(b);
      });
    if (f.order == Forms::Order::pairwise) return start + tree(terms, 0, terms.size());
    float sum = start;
    for (const Term& t : terms) sum = f.fused ? std::fma(t[0], t[1], sum) : sum + t[0] * t[1];
    return sum;
  }

  const Forms& f;
  float H, h, inverse_h, m, rho0, inverse_rho0, B, gamma, mu, mu_w, w, g;

 private:
  float tree(const std::vector<Term>& terms, std::size_t begin, std::size_t end) const {
    if (begin == end) return 0;
    if (end - begin == 1) return terms[begin][0] * terms[begin][1];
    const std::size_t middle = (begin + end) / 2;
    return tree(terms, begin, middle) + tree(terms, middle, end);
  }

  const Scene& scene_;
  float cell_;
  std::array<bool, 3> periodic_;
  F3 L_;
  std::mt19937 random_{7};
};

/// Wall particles in the world and their velocities, by the poses that the oracle hands out.
void place(const Forms& f, const Scene& scene, const Walls& walls, double time, std::vector<F3>& position,
           std::vector<F3>& velocity) {
  for (std::size_t c = 0; c < walls.containers.size(); ++c) {
    const Container& container = scene.containers[c];
    const Pose pose = pose_at(container, time);
    const F3 t = float3(pose.translation), p = float3(pose.pivot), o = float3(container.origin),
             omega = float3(pose.angular_velocity), belt = float3(pose.surface_velocity),
             linear = float3(pose.linear_velocity),
             before = float3(container.tilt ? container.tilt->pivot : Vec3::Zero());
    const Eigen::Quaterniond turn(pose.rotation);
    const float qw = static_cast<float>(turn.w());
    const F3 qv = float3(turn.vec());
    const auto rotated = [&](F3 a) {
      if (f.placing == Forms::Placing::quaternion) {
        const F3 s = cross(qv, a);
        return a + ((2.0f * qw) * s + 2.0f * cross(qv, s));
      }
      F3 out;
      for (int row = 0; row < 3; ++row) {
        const F3 R = float3(pose.rotation.row(row));
        out[static_cast<std::size_t>(row)] =
            f.fused ? std::fma(R[0], a[0], std::fma(R[1], a[1], R[2] * a[2])) : R[0] * a[0] + R[1] * a[1] + R[2] * a[2];
      }
      return out;
    };
    for (Eigen::Index k = 0; k < walls.containers[c].position.cols(); ++k) {
      const F3 local = float3(walls.containers[c].position.col(k));
      F3 x, lever;
      if (!container.tilt) {
        x = local + t;
        lever = x - p;
      } else {
        const F3 arm = rotated((local + o) - before);
        x = f.placing == Forms::Placing::pivot ? p + arm : rotated(local) + t;
        lever = f.velocity == Forms::Velocity::local ? arm : x - p;
      }
      position.push_back(x);
      velocity.push_back(cross(omega, lever) + linear + belt);
    }
  }
}

/// While it lives, numbers below 2⁻¹²⁶ are 0 as operands and as results, where the host can.
#ifdef __SSE2__
class FlushToZero {
 public:
  explicit FlushToZero(bool flushed) : before_(_mm_getcsr()) {
    if (flushed) _mm_setcsr(before_ | 0x8040);  // FTZ, DAZ
  }
  FlushToZero(const FlushToZero&) = delete;
  FlushToZero& operator=(const FlushToZero&) = delete;
  ~FlushToZero() { _mm_setcsr(before_); }

 private:
  unsigned before_;
};
#else
struct FlushToZero {
  explicit FlushToZero(bool) {}
  ~FlushToZero() {}
};
#endif

}  // namespace

Fields evaluate_by(const Forms& forms, const Scene& scene, const Walls& walls, const ParticleState& state,
                   const StageInputs* given) {
  Evaluator e(forms, scene);
  const double time = scene.time_at(state.substep);
  Neighbors near;
  find_neighbors(scene, state.position, pose_walls(scene, walls, time).position, NeighborSearch::cells, near);
  const WallNeighbors wall_near = find_wall_neighbors(scene, walls);
  const FlushToZero mode(forms.flushed);
  std::vector<F3> wall, wall_v;
  place(forms, scene, walls, time, wall, wall_v);
  const auto n = static_cast<std::size_t>(state.size());
  Fields out = Fields::unwritten(state.size(), walls.size());

  std::vector<Term> terms;
  std::vector<float> V(wall.size()), rho(n), p(n), q(n);
  for (std::size_t b = 0; b < V.size(); ++b) {
    const F3 x_b = float3(wall_near.position.col(static_cast<Eigen::Index>(b)));
    terms = {{e.W(0), 1.0f}};
    for (const auto k : wall_near.near[b])
      terms.push_back({e.W(e.square(e.difference(x_b, float3(wall_near.position.col(k))))), 1.0f});
    V[b] = 1.0f / e.total(terms, 0);
    out.boundary_volume[static_cast<Eigen::Index>(b)] = static_cast<double>(V[b]);
  }
  std::vector<F3> x(n), v(n);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = float3(state.position.col(static_cast<Eigen::Index>(i)));
    v[i] = float3(state.velocity.col(static_cast<Eigen::Index>(i)));
  }
  for (std::size_t i = 0; i < n; ++i) {
    const auto id = static_cast<Eigen::Index>(i);
    terms = {{e.m, e.W(0)}};
    for (const auto j : near.fluid[i])
      terms.push_back({e.m, e.W(e.square(e.difference(x[i], x[static_cast<std::size_t>(j)])))});
    for (const auto b : near.wall[i])
      terms.push_back({e.rho0 * V[static_cast<std::size_t>(b)],
                       e.W(e.square(e.difference(x[i], wall[static_cast<std::size_t>(b)])))});
    rho[i] = e.total(terms, 0);
    out.density[id] = static_cast<double>(rho[i]);
    if (given && given->density.size()) rho[i] = static_cast<float>(given->density[id]);
    p[i] = e.pressure(rho[i]);
    out.pressure[id] = static_cast<double>(p[i]);
    if (given && given->pressure.size()) p[i] = static_cast<float>(given->pressure[id]);
    q[i] = e.q_pressure(p[i], rho[i]);
  }
  const bool after_sum = forms.factor == Forms::Factor::after_sum;
  const F3 gravity = float3(scene.gravity);
  for (std::size_t i = 0; i < n; ++i) {
    // Pressure, viscous, wall pressure, wall viscous, by component.
    std::array<std::array<std::vector<Term>, 3>, 4> parts;
    for (const auto id : near.fluid[i]) {
      const auto j = static_cast<std::size_t>(id);
      const F3 d = e.difference(x[i], x[j]), dv = v[j] - v[i];
      const float r2 = e.square(d), G = e.G(r2), L = e.viscous(r2, G);
      const float push = e.m * (q[i] + q[j]) * G;
      const float drag = after_sum ? e.m / rho[j] * L : e.mu / rho[i] * (e.m / rho[j]) * L;
      for (std::size_t c = 0; c < 3; ++c) {
        parts[0][c].push_back({push, d[c]});
        parts[1][c].push_back({drag, dv[c]});
      }
    }
    for (const auto id : near.wall[i]) {
      const auto b = static_cast<std::size_t>(id);
      const F3 d = e.difference(x[i], wall[b]), dv = wall_v[b] - v[i];
      const float r2 = e.square(d), G = e.G(r2), L = e.viscous(r2, G);
      const float push = e.rho0 * V[b] * q[i] * G;
      const float drag = after_sum ? V[b] * L : e.mu_w / rho[i] * V[b] * L;
      for (std::size_t c = 0; c < 3; ++c) {
        parts[2][c].push_back({push, d[c]});
        parts[3][c].push_back({drag, dv[c]});
      }
    }
    const float scale[4] = {1.0f, after_sum ? e.mu / rho[i] : 1.0f, 1.0f, after_sum ? e.mu_w / rho[i] : 1.0f};
    Eigen::Matrix3Xd Fields::* fields[4] = {&Fields::pressure_acceleration, &Fields::viscous_acceleration,
                                            &Fields::wall_pressure_acceleration, &Fields::wall_viscous_acceleration};
    for (std::size_t c = 0; c < 3; ++c) {
      const auto row = static_cast<Eigen::Index>(c), column = static_cast<Eigen::Index>(i);
      float sum[4];
      for (std::size_t k = 0; k < 4; ++k) {
        sum[k] = scale[k] * e.total(parts[k][c], 0);
        (out.*fields[k])(row, column) = static_cast<double>(sum[k]);
      }
      float a = (sum[0] + sum[2]) + (sum[1] + sum[3]) + gravity[c];
      if (forms.accumulate != Forms::Register::parts) {
        terms.clear();
        for (std::size_t k = 0; k < 4; ++k)
          for (const Term& t : parts[k][c]) terms.push_back({scale[k] * t[0], t[1]});
        const bool first = forms.accumulate == Forms::Register::gravity_first;
        a = e.total(terms, first ? gravity[c] : 0.0f);
        if (!first) a += gravity[c];
      }
      out.acceleration(row, column) = static_cast<double>(a);
    }
  }
  return out;
}

std::map<std::string, double> scores(const Fields& got, const ReferenceSolution& oracle) {
  std::map<std::string, double> worst;
  const auto score = [&](const char* name, const auto& values, const auto& expected, const auto& tau) {
    double& most = worst[name];
    for (Eigen::Index k = 0; k < values.size(); ++k)
      most = std::max(most, score_of(std::abs(values.reshaped()[k] - expected.reshaped()[k]), tau.reshaped()[k]));
  };
  for (const StageField& s : stage_fields)
    score(s.name, got.*s.member, oracle.fields.*s.member, oracle.tolerance.*s.member);
  for (const AccelerationField& a : acceleration_fields)
    score(a.name, got.*a.member, oracle.fields.*a.member, oracle.tolerance.*a.member);
  return worst;
}

}  // namespace decant::test
