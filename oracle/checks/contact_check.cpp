/// \file
/// Where probes start, and how they are judged.
#include "oracle/checks/contact_check.hpp"

#include "oracle/checks/field_checks.hpp"
#include "oracle/solution/contact_bounds.hpp"
#include "oracle/solution/force_free.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace decant {
namespace {

// Enough for each face and edge of a cup to see every way of coming several times; of particles of the
// fixture's own as many at most.
constexpr int most_probes = 600;

/// The same numbers on every machine, as std::uniform_real_distribution's are not.
class Draw {
 public:
  double operator()(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  int below(int n) { return static_cast<int>(random_() % static_cast<std::uint64_t>(n)); }
  Vec3 in_ball() {
    for (;;) {
      const Vec3 v((*this)(-1, 1), (*this)(-1, 1), (*this)(-1, 1));
      if (v.squaredNorm() <= 1) return v;
    }
  }

 private:
  std::mt19937_64 random_{20240611};
};

/// A place on a surface.
struct Surface {
  Vec3 at, normal;    // m, container frame
  bool flat = false;  // its normal is the same all around, and that of a point on it no difference of near points
};

/// One in three at an end or edge, where two faces meet.
double fraction(Draw& draw) { return draw.below(3) == 0 ? draw.below(2) : draw(0, 1); }

Surface on_edge(const ProfileEdge& e, Draw& draw) {
  const double s = fraction(draw), angle = draw(0, 2 * std::numbers::pi);
  const double length = std::hypot(e.r1 - e.r0, e.z1 - e.z0), c = std::cos(angle), t = std::sin(angle);
  const double r = e.r0 + s * (e.r1 - e.r0), z = e.z0 + s * (e.z1 - e.z0);
  const double nr = (e.z1 - e.z0) / length, nz = -(e.r1 - e.r0) / length;
  return {{r * c, r * t, z}, {nr * c, nr * t, nz}};
}

Surface on_face(const BoxFace& f, Draw& draw) {
  Surface s{f.min, f.side * Vec3::Unit(f.axis), true};
  for (int a = 0; a < 3; ++a)
    if (a != f.axis) s.at[a] += fraction(draw) * (f.max[a] - f.min[a]);
  return s;
}

bool inside(const Domain& domain, const Vec3& x, double margin) {
  for (int a = 0; a < 3; ++a)
    if (!domain.periodic[static_cast<std::size_t>(a)] &&
        !(x[a] >= domain.min[a] + margin && x[a] <= domain.max[a] - margin))
      return false;
  return true;
}

class Probes {
 public:
  /// \param reference_speed  m/s, of fast probes
  Probes(const Scene& scene, std::int64_t substep, double reference_speed)
      : scene_(scene), bounds_(scene_), speed_(reference_speed), substep_(substep) {
    for (int k = 0; k <= contact_run; ++k) poses_.push_back(bounds_.poses_at(scene_.time_at(substep + k)));
  }

  void add(const Vec3& position, const Vec3& velocity) {
    x_.push_back(position);
    v_.push_back(velocity);
  }

  /// Those of the state that touch a wall one substep on.
  void add_touching(const ParticleState& state, const Eigen::Matrix3Xd& acceleration) {
    const double dt = scene_.time_step(), reach = scene_.contact_distance();
    std::vector<Eigen::Index> touching;
    for (Eigen::Index i = 0; i < state.size(); ++i) {
      const Vec3 x = state.position.col(i) + dt * (state.velocity.col(i) + dt * acceleration.col(i));
      bool near = scene_.floor && x.z() - scene_.floor->height < reach;
      for (std::size_t c = 0; c < bounds_.solids().size() && !near; ++c) {
        const Vec3 local = poses_[1][c].to_local(x);
        near = bounds_.solids()[c].may_be_within(reach, local) && bounds_.solids()[c].at(local).distance < reach;
      }
      if (near) touching.push_back(i);
    }
    const std::size_t step = touching.size() / most_probes + 1;
    for (std::size_t k = 0; k < touching.size(); k += step) {
      const Eigen::Index i = touching[k];
      add(state.position.col(i), state.velocity.col(i) + dt * acceleration.col(i));
    }
  }

  void add_around_walls() {
    std::size_t places = scene_.floor ? 1 : 0;
    for (std::size_t c = 0; c < scene_.containers.size(); ++c)
      places += bounds_.edges(c).size() + bounds_.faces(c).size();
    if (places == 0) return;
    const int each = std::max(2, most_probes / static_cast<int>(places));
    for (std::size_t c = 0; c < scene_.containers.size(); ++c) {
      for (const auto& e : bounds_.edges(c))
        for (int k = 0; k < each; ++k) add_at(c, on_edge(e, draw_));
      for (const auto& f : bounds_.faces(c))
        for (int k = 0; k < each; ++k) add_at(c, on_face(f, draw_));
      add_level_with_corners(c);
    }
    for (int k = 0; k < each && scene_.floor; ++k) {
      Vec3 x = scene_.domain.min;
      for (int a = 0; a < 2; ++a) x[a] = draw_(scene_.domain.min[a], scene_.domain.max[a]);
      x.z() = scene_.floor->height;
      add_at(scene_.containers.size(), {x, Vec3::UnitZ(), true});
    }
  }

  ContactProblem take() {
    ContactProblem problem{scene_, drawn(), {}, {}, {}};
    ParticleState& state = problem.state;
    Eigen::Index n = 0;
    for (Eigen::Index i = 0; i < state.size(); ++i) {
      const Vec3 x = state.position.col(i), v = state.velocity.col(i);
      Followed first, later;
      if (!follow(x, v, first, later) || !first.known) continue;
      if (later.known) {
        problem.later_id.push_back(n);
        problem.later.push_back(std::move(later.outcomes));
      }
      problem.first.push_back(std::move(first.outcomes));
      state.position.col(n) = x;
      state.velocity.col(n++) = v;
    }
    state.position.conservativeResize(3, n);
    state.velocity.conservativeResize(3, n);
    return problem;
  }

 private:
  /// All that were added, rounded to fp32 as every state is.
  ParticleState drawn() const {
    ParticleState state;
    state.substep = substep_;
    state.position.resize(3, static_cast<Eigen::Index>(x_.size()));
    state.velocity.resize(3, static_cast<Eigen::Index>(v_.size()));
    for (std::size_t i = 0; i < x_.size(); ++i) {
      state.position.col(static_cast<Eigen::Index>(i)) = x_[i];
      state.velocity.col(static_cast<Eigen::Index>(i)) = v_[i];
    }
    state.quantise();
    return state;
  }

  /// Ones at rest beside an upright container that stands still, exactly as high as a corner of its outline: whether
  /// such a point is inside must not depend on which of two edges a corner belongs to.
  void add_level_with_corners(std::size_t c) {
    const Pose& pose = poses_[1][c];
    if (moves(scene_.containers[c]) || !pose.rotation.isIdentity(0)) return;
    for (const ProfileEdge& e : bounds_.edges(c))
      for (const double share : {0.35, 0.8}) {
        const double r = share * e.r0, angle = draw_(0, 2 * std::numbers::pi);
        add(pose.translation + Vec3(r * std::cos(angle), r * std::sin(angle), e.z0), pose.surface_velocity);
      }
  }

  /// One that meets the surface of container c (its number: the floor), now or some substeps on.
  void add_at(std::size_t c, const Surface& surface) {
    static constexpr int when[] = {1, 1, 1, 1, 2, 4, 8};
    static constexpr double depth[] = {0.9, 0.6, 0.2, -0.5, -2.0, 0};  // contact distances
    const int depths = surface.flat ? 6 : 5;
    const int steps = when[draw_.below(7)], way = draw_.below(5);
    const Pose pose = c < scene_.containers.size() ? poses_[static_cast<std::size_t>(steps)][c] : Pose{};
    const double dt = scene_.time_step(), reach = scene_.contact_distance();
    const Vec3 normal = pose.rotation * surface.normal;
    Vec3 along = draw_.in_ball();
    along -= along.dot(normal) * normal;
    Vec3 x = pose.to_world(surface.at) + 0.7 * reach * along;
    const Vec3 wall = pose.velocity_at(x);
    const Vec3 slides = along.norm() > 0 ? Vec3(along / along.norm()) : Vec3(Vec3::Zero());
    const double speed = speed_ * (draw_.below(3) == 0 ? 0.05 : 1.0);
    Vec3 v = wall;
    switch (way) {
      case 0:
        v += speed * (-normal + 0.3 * slides);
        break;
      case 1:
        v += speed * (-0.3 * normal + slides);
        break;
      case 2:
        v += speed * (-0.01 * normal + slides);
        break;
      case 3:
        v += speed * (0.3 * normal + slides);
        break;
      default:
        v = Vec3::Zero();
    }
    // After some flight no deeper than a substep's way can be.
    const double closing = std::max(0.0, (wall - v).dot(normal)) * dt;
    x += (steps == 1 ? depth[draw_.below(depths)] * reach : reach - draw_(0.1, 0.9) * closing) * normal;
    add(x - steps * dt * v, v);
  }

  /// A probe so many substeps on, by the decisions of `flips`; visit(k, particle) after each.
  template <class Visit>
  BoundedParticle run(const Vec3& x, const Vec3& v, int substeps, unsigned flips, Visit visit) const {
    BoundedParticle p{x, v, {}, {}};
    p.flips = flips;
    for (int k = 1; k <= substeps; ++k) {
      p.tau_v.add(Vec3::Constant(scene_.time_step() * force_free_acceleration));
      bounds_.fly(p);
      bounds_.collide(poses_[static_cast<std::size_t>(k)], p);
      visit(k, p);
    }
    return p;
  }

  /// Outcomes of a probe, and whether its contacts can be told.
  struct Followed {
    std::vector<SubstepOutcome> outcomes;
    bool known = true;

    void add(const BoundedParticle& p) {
      outcomes.push_back({p.x, p.v, p.tau_x.components, p.tau_v.components});
      known = known && !p.ambiguous && p.undecided <= most_undecided;
    }
  };
  /// One substep on and all of them; false where it leaves the domain on any way.
  bool follow(const Vec3& x, const Vec3& v, Followed& first, Followed& later) const {
    bool stays = inside(scene_.domain, x, scene_.particle_spacing), one_way = true;
    const auto stays_at = [&](const BoundedParticle& p) {
      stays = stays && inside(scene_.domain, p.x, 0.1 * scene_.particle_spacing);
    };
    each_decision(
        [&](unsigned flips) {
          return run(x, v, contact_run, flips, [&](int k, const BoundedParticle& p) {
            stays_at(p);
            if (k > 1 || flips > 0) return;
            one_way = p.undecided == 0;
            if (one_way) first.add(p);
          });
        },
        [&](const BoundedParticle& p) { later.add(p); });
    if (!one_way)
      each_decision(
          [&](unsigned flips) { return run(x, v, 1, flips, [&](int, const BoundedParticle& p) { stays_at(p); }); },
          [&](const BoundedParticle& p) { first.add(p); });
    gather_images(scene_.domain, first.outcomes);
    gather_images(scene_.domain, later.outcomes);
    return stays;
  }

  Scene scene_;
  ContactBounds bounds_;
  double speed_;
  std::int64_t substep_;
  std::vector<std::vector<Pose>> poses_;  // of each substep
  std::vector<Vec3> x_, v_;
  Draw draw_;
};

double fastest_wall(const Scene& scene, std::int64_t substep) {
  double fastest = 0;
  for (const Container& c : scene.containers) {
    if (!moves(c)) continue;
    const Pose pose = pose_at(c, scene.time_at(substep));
    const Vec3 beside = pose.translation + scene.support_radius() * Vec3(0.6, 0.5, 0.4);
    fastest = std::max(fastest, (pose.velocity_at(beside) - pose.surface_velocity).norm());
  }
  return fastest;
}

/// The substep at which walls move fastest.
std::int64_t fastest_substep(const Scene& scene, std::int64_t own) {
  constexpr int samples = 256;
  const auto all = static_cast<std::int64_t>(scene.schedule.frames) * scene.schedule.substeps_per_frame;
  std::int64_t best = own;
  for (int k = 0; k < samples; ++k) {
    const std::int64_t at = all * k / samples;
    if (fastest_wall(scene, at) > 1.001 * fastest_wall(scene, best)) best = at;
  }
  return best;
}

struct Compared {
  Values position, velocity;
};

template <class Matrix>
void append(Eigen::VectorXd& to, const Matrix& m) {
  const Eigen::VectorXd more = flat(m);
  to.conservativeResize(to.size() + more.size());
  to.tail(more.size()) = more;
}

void append(Compared& all, const Scene& scene, const ParticleState& read,
            const std::vector<std::vector<SubstepOutcome>>& outcomes) {
  const ParticleState got = nearest_images(read, scene, outcomes);
  const NearestOutcomes nearest = nearest_outcomes(outcomes, got);
  append(all.position.actual, got.position);
  append(all.position.expected, nearest.position);
  append(all.position.tolerance, nearest.position_tolerance);
  append(all.velocity.actual, got.velocity);
  append(all.velocity.expected, nearest.velocity);
  append(all.velocity.tolerance, nearest.velocity_tolerance);
}

}  // namespace

std::vector<ContactProblem> contact_problems(const Scene& scene, const ParticleState& state,
                                             const Eigen::Matrix3Xd& acceleration) {
  std::vector<ContactProblem> problems;
  if (scene.containers.empty() && !scene.floor) return problems;
  const double speed = std::min(0.1 * scene.fluid.sound_speed, 0.2 * scene.particle_spacing / scene.time_step());
  Scene free = force_free(scene);
  Probes own(free, state.substep, speed);
  own.add_touching(state, acceleration);
  own.add_around_walls();
  problems.push_back(own.take());

  Contact& contact = free.contact;
  const bool left_out = contact.restitution == 0 || contact.friction == 0;
  const std::int64_t fastest = fastest_substep(scene, state.substep);
  if (!left_out && fastest == state.substep) return problems;
  if (contact.restitution == 0) contact.restitution = 0.3;
  if (contact.friction == 0) contact.friction = 0.2;
  Probes moving(free, fastest, speed);
  moving.add_around_walls();
  problems.push_back(moving.take());
  return problems;
}

void check_contact(Backend& backend, const Walls& walls, const std::vector<ContactProblem>& problems,
                   RowBuilder& builder) {
  Compared first, later;
  for (auto* values : {&first.position, &first.velocity, &later.position, &later.velocity}) values->components = 3;
  for (const ContactProblem& problem : problems) {
    const auto n = problem.state.size();
    const auto advance = [&](int substeps, ParticleState& state) {
      if (const Status status = backend.advance(substeps); !status.ok()) {
        builder.failed("contact", describe(status));
        return false;
      }
      backend.read(state);
      if (state.position.cols() == n && state.velocity.cols() == n) return true;
      builder.failed("contact", fmt::format("{} positions and {} velocities, not {}", state.position.cols(),
                                            state.velocity.cols(), n));
      return false;
    };
    backend.load(problem.scene, walls, problem.state);
    ParticleState state;
    if (!advance(1, state)) return;
    append(first, problem.scene, state, problem.first);
    if (!advance(contact_run - 1, state)) return;
    ParticleState told;
    told.position = state.position(Eigen::all, problem.later_id);
    told.velocity = state.velocity(Eigen::all, problem.later_id);
    append(later, problem.scene, told, problem.later);
  }
  const auto row = [&](const std::string& field, const char* unit, const Values& values, bool after_the_run) {
    CheckRow& r = builder.row("contact", field, unit);
    compare(values, r);
    if (r.verdict != Verdict::fail || r.worst_id < 0) return;
    // Ids are those of probes, and of nobody in the fixture.
    std::int64_t probe = r.worst_id;
    r.worst_id = -1;
    for (const ContactProblem& problem : problems) {
      const auto count = static_cast<std::int64_t>(after_the_run ? problem.later_id.size() : problem.first.size());
      if (probe >= count) {
        probe -= count;
        continue;
      }
      const Eigen::Index i = after_the_run ? problem.later_id[static_cast<std::size_t>(probe)] : probe;
      const Vec3 x = problem.state.position.col(i), v = problem.state.velocity.col(i);
      r.reason = fmt::format("a probe from ({:.9g}, {:.9g}, {:.9g}) m at ({:.9g}, {:.9g}, {:.9g}) m/s, substep {}",
                             x.x(), x.y(), x.z(), v.x(), v.y(), v.z(), problem.state.substep);
      return;
    }
  };
  const std::string run = fmt::format(" after {}", contact_run);
  row("position", "m", first.position, false);
  row("velocity", "m/s", first.velocity, false);
  row("position" + run, "m", later.position, true);
  row("velocity" + run, "m/s", later.velocity, true);
}

}  // namespace decant
