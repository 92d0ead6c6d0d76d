/// \file
/// Copies of a state, what a reference says of each, and how far that is apart.
#include "oracle/checks/measured_reference.hpp"

#include "oracle/checks/field_checks.hpp"
#include "oracle/checks/run_ahead.hpp"
#include "reference/error.hpp"
#include "reference/sampling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

namespace decant {
namespace {

using Order = std::vector<Eigen::Index>;

/// A problem, with particle i of the fixture at place of[i].
struct Copy {
  Scene scene;
  Walls walls;
  ParticleState state;
  StageInputs given;
  Order of;
};

class CopyMaker {
 public:
  explicit CopyMaker(unsigned seed) : random_(seed) {}

  Copy operator()(const Scene& scene, const Walls& walls, const ParticleState& state, const StageInputs* given) {
    const Eigen::Index n = state.size();
    Copy copy{scene, walls, state, {}, Order(static_cast<std::size_t>(n))};
    Order from(copy.of.size());
    std::iota(from.begin(), from.end(), Eigen::Index{0});
    std::shuffle(from.begin(), from.end(), random_);
    for (std::size_t k = 0; k < from.size(); ++k)
      copy.of[static_cast<std::size_t>(from[k])] = static_cast<Eigen::Index>(k);
    copy.state.position = state.position(Eigen::all, from);
    copy.state.velocity = state.velocity(Eigen::all, from);
    for (Eigen::Index i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) {
        const double x = moved(copy.state.position(c, i));
        // What leaves the domain is another problem.
        if (x >= scene.domain.min[c] && x <= scene.domain.max[c]) copy.state.position(c, i) = x;
        copy.state.velocity(c, i) = moved(copy.state.velocity(c, i));
      }
    for (BoundaryParticles& container : copy.walls.containers)
      for (double& x : container.position.reshaped()) x = moved(x);
    if (!given) return copy;
    copy.given.density = given->density(from);
    copy.given.pressure = given->pressure(from);
    for (double& x : copy.given.density) x = moved(x);
    for (double& x : copy.given.pressure) x = moved(x);
    return copy;
  }

 private:
  /// An fp32 number, moved by half an ulp at most.
  double moved(double x) {
    const auto single = std::abs(static_cast<float>(x));
    const double ulp = static_cast<double>(std::nextafter(single, std::numeric_limits<float>::infinity())) - single;
    return x + 0.5 * ulp * side_(random_);
  }

  std::mt19937 random_;
  std::uniform_real_distribution<double> side_{-1, 1};
};

double root_mean_square(const Eigen::Ref<const Eigen::MatrixXd>& values) {
  return values.size() == 0 ? 0 : values.norm() / std::sqrt(static_cast<double>(values.size()));
}

/// tau of every value. \param spread  shaped alike
template <class Matrix>
Matrix tolerance_of(const Matrix& values, const Matrix& spread) {
  const double floor = measured_factor * unit_roundoff;
  return measured_factor * spread + floor * (values.cwiseAbs().array() + root_mean_square(values)).matrix();
}

/// Real fields of both shapes alike. \param visit  (name, member)
template <class Visit>
void each_real_field(const Visit& visit) {
  for (const StageField& field : stage_fields) visit(field.name, field.member);
  for (const AccelerationField& field : acceleration_fields) visit(field.name, field.member);
}

class Measuring {
 public:
  explicit Measuring(Backend& reference) : reference_(reference), answered_(answered_by(reference.offers())) {}

  ReferenceSolution solution(const Scene& scene, const Walls& walls, const ParticleState& state,
                             const StageInputs* given = nullptr) {
    ReferenceSolution found;
    found.fields = fields(scene, walls, state, given);
    Fields spread = Fields::unwritten(state.size(), walls.size());
    each_real_field([&](const char*, auto member) { (spread.*member).setZero(); });
    // Who is too near to H to be counted is a matter of geometry, whatever the formulas.
    ReferenceSolution geometry = reference_solution(scene, walls, state);
    found.fluid_ambiguous = std::move(geometry.fluid_ambiguous);
    found.wall_ambiguous = std::move(geometry.wall_ambiguous);
    found.most_fluid_ambiguous = geometry.most_fluid_ambiguous;
    found.most_wall_ambiguous = geometry.most_wall_ambiguous;
    CopyMaker copies(seed);
    for (int k = 0; k < measured_copies; ++k) {
      const Copy copy = copies(scene, walls, state, given);
      const Fields other = fields(copy.scene, copy.walls, copy.state, given ? &copy.given : nullptr);
      each_real_field([&](const char*, auto member) {
        const bool in_place = member_is_of_walls(member);
        widen(spread.*member, found.fields.*member, in_place ? other.*member : ordered(other.*member, copy.of));
      });
    }
    found.tolerance = Fields::unwritten(state.size(), walls.size());
    each_real_field([&](const char*, auto member) {
      found.tolerance.*member = tolerance_of(found.fields.*member, spread.*member);
    });
    return found;
  }

  SubstepSolution substep(const Fixture& fixture, const Walls& walls) {
    const Scene& scene = fixture.scene;
    const auto after = [&](const Scene& where, const Walls& around, const ParticleState& state) {
      reference_.load(where, around, state);
      return advanced(1, state.size());
    };
    const ParticleState plain = after(scene, walls, fixture.state);
    Eigen::Matrix3Xd position = Eigen::Matrix3Xd::Zero(3, plain.size()), velocity = position;
    CopyMaker copies(seed);
    for (int k = 0; k < measured_copies; ++k) {
      const Copy copy = copies(scene, walls, fixture.state, nullptr);
      ParticleState other = after(copy.scene, copy.walls, copy.state);
      for (Eigen::Index i = 0; i < plain.size(); ++i)
        for (int c = 0; c < 3; ++c) {
          if (!scene.domain.periodic[static_cast<std::size_t>(c)]) continue;
          double& x = other.position(c, copy.of[static_cast<std::size_t>(i)]);
          const double period = scene.domain.max[c] - scene.domain.min[c];
          x -= period * std::round((x - plain.position(c, i)) / period);
        }
      widen(position, plain.position, ordered(other.position, copy.of));
      widen(velocity, plain.velocity, ordered(other.velocity, copy.of));
    }
    position = tolerance_of(plain.position, position);
    velocity = tolerance_of(plain.velocity, velocity);
    SubstepSolution found;
    found.ambiguous.assign(static_cast<std::size_t>(plain.size()), false);
    for (Eigen::Index i = 0; i < plain.size(); ++i)
      found.outcomes.push_back(
          {SubstepOutcome{plain.position.col(i), plain.velocity.col(i), position.col(i), velocity.col(i)}});
    return found;
  }

  ParticleState advanced(int substeps, Eigen::Index particles) {
    require(reference_.advance(substeps));
    ParticleState state;
    reference_.read(state);
    if (state.position.cols() != particles || state.velocity.cols() != particles)
      fail(fmt::format("{} positions and {} velocities, not {}", state.position.cols(), state.velocity.cols(),
                       particles));
    require_finite("position", state.position);
    require_finite("velocity", state.velocity);
    return state;
  }

 private:
  static constexpr unsigned seed = 1;

  static bool member_is_of_walls(Eigen::VectorXd Fields::* member) { return member == &Fields::boundary_volume; }
  static bool member_is_of_walls(Eigen::Matrix3Xd Fields::*) { return false; }

  template <class Matrix>
  static Matrix ordered(const Matrix& values, const Order& of) {
    if constexpr (Matrix::ColsAtCompileTime == 1) return values(of);
    else return values(Eigen::all, of);
  }
  template <class Matrix>
  static void widen(Matrix& spread, const Matrix& values, const Matrix& other) {
    spread = spread.cwiseMax((other - values).cwiseAbs());
  }

  Fields fields(const Scene& scene, const Walls& walls, const ParticleState& state, const StageInputs* given) {
    reference_.load(scene, walls, state);
    Fields found = Fields::unwritten(state.size(), walls.size());
    require(reference_.evaluate(found, given));
    each_real_field([&](const char* name, auto member) {
      // What comes before a stage that was handed in need not be computed.
      const bool before = given && (std::string(name) == "density" || std::string(name) == "boundary_volume");
      if (answered_.count(name) && !before) require_finite(name, found.*member);
    });
    return found;
  }

  void require(const Status& status) const {
    if (!status.ok()) fail(describe(status));
  }

  void require_finite(const char* name, const Eigen::Ref<const Eigen::MatrixXd>& values) const {
    for (Eigen::Index i = 0; i < values.size(); ++i)
      if (const double x = values.reshaped()[i]; !std::isfinite(x))
        fail(fmt::format("{} {} is {}", name, values.cols() == 1 ? i : i / values.rows(), x));
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw BackendError("the reference " + reference_.info().name + ": " + what);
  }

  Backend& reference_;
  Answered answered_;
};

}  // namespace

const CheckSelection& measured_checks() {
  static const CheckSelection checks{"fields",      "substep",      "mass",       "containment",
                                     "determinism", "conservation", "invariance", "status"};
  return checks;
}

PreparedReference measured_reference(Backend& reference, const Fixture& fixture, const CheckSelection& checks,
                                     int sample_every) {
  const Scene& scene = fixture.scene;
  const auto wanted = [&](std::initializer_list<const char*> names) {
    return std::ranges::any_of(names, [&](const char* name) { return checks.count(name) > 0; });
  };
  PreparedReference prepared;
  prepared.offers = reference.offers();
  prepared.walls = sample_walls(scene);
  if (prepared.walls.size() > 0 && !(prepared.offers & Offer::walls))
    throw BackendError("the reference " + reference.info().name + " does not offer walls");
  Measuring measuring(reference);
  prepared.own = measuring.solution(scene, prepared.walls, fixture.state);
  prepared.inputs = stage_inputs(scene, prepared.own.fields, Staged::offset);
  if (wanted({"fields", "conservation"}) && (prepared.offers & Offer::given))
    prepared.given = measuring.solution(scene, prepared.walls, fixture.state, &prepared.inputs);
  if (wanted({"invariance"}))
    for (TransformedProblem& problem : transformed_problems(scene, fixture.state)) {
      Walls walls = sample_walls(problem.scene);
      ReferenceSolution solution = measuring.solution(problem.scene, walls, problem.state);
      prepared.transformed.push_back({std::move(problem), std::move(walls), std::move(solution)});
    }
  if (!(prepared.offers & Offer::step)) return prepared;
  if (wanted({"substep"})) prepared.substep = measuring.substep(fixture, prepared.walls);
  if (wanted({"mass", "containment", "determinism"})) {
    prepared.segments = segments_of(fixture, sample_every);
    for (Segment& segment : prepared.segments) segment.viewed = false;
    reference.load(scene, prepared.walls, fixture.state);
    run_ahead(fixture, prepared, [&](int substeps) { return measuring.advanced(substeps, fixture.state.size()); });
  }
  return prepared;
}

}  // namespace decant
