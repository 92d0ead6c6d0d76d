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
  explicit CopyMaker(unsigned seed) : random_(seed), given_random_(seed) {}

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
    // By draws of their own: a copy is the same whether inputs are handed in or not.
    for (double& x : copy.given.density) x = moved(x, given_random_);
    for (double& x : copy.given.pressure) x = moved(x, given_random_);
    return copy;
  }

 private:
  /// An fp32 number, moved by half an ulp at most.
  double moved(double x) { return moved(x, random_); }
  double moved(double x, std::mt19937& random) {
    const auto single = std::abs(static_cast<float>(x));
    const double ulp = static_cast<double>(std::nextafter(single, std::numeric_limits<float>::infinity())) - single;
    return x + 0.5 * ulp * side_(random);
  }

  std::mt19937 random_, given_random_;
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

/// What a reference says of one problem.
struct Answer {
  Fields own, given;    // given: from inputs that are handed in
  ParticleState after;  // one substep on
};

/// What is asked beside the fields.
struct Asked {
  bool given = false, substep = false;
};

/// What it says of a state, and how far that moves at most.
struct Measured {
  Answer plain, spread;
  StageInputs inputs;
};

std::vector<std::vector<SubstepOutcome>> outcomes_of(const ParticleState& after, const Eigen::Matrix3Xd& position,
                                                     const Eigen::Matrix3Xd& velocity) {
  std::vector<std::vector<SubstepOutcome>> outcomes;
  for (Eigen::Index i = 0; i < after.size(); ++i)
    outcomes.push_back({{after.position.col(i), after.velocity.col(i), position.col(i), velocity.col(i)}});
  return outcomes;
}

class Measuring {
 public:
  explicit Measuring(Backend& reference) : reference_(reference), answered_(answered_by(reference.offers())) {}

  /// One load per copy, and all that is asked of it.
  Measured measured(const Scene& scene, const Walls& walls, const ParticleState& state, Asked asked = {}) {
    Measured found;
    found.plain.own = loaded(scene, walls, state);
    found.inputs = stage_inputs(scene, found.plain.own, Staged::offset);
    answer(found.plain, found.inputs, walls.size(), state.size(), asked);
    found.spread = {zeros(state.size(), walls.size()), zeros(state.size(), walls.size()), found.plain.after};
    found.spread.after.position.setZero();
    found.spread.after.velocity.setZero();
    const auto images = outcomes_of(found.plain.after, found.spread.after.position, found.spread.after.velocity);
    CopyMaker copies(seed);
    for (int k = 0; k < measured_copies; ++k) {
      const Copy copy = copies(scene, walls, state, &found.inputs);
      Answer other{loaded(copy.scene, copy.walls, copy.state), {}, {}};
      answer(other, copy.given, walls.size(), state.size(), asked);
      widen(found.spread.own, found.plain.own, other.own, copy.of);
      if (asked.given) widen(found.spread.given, found.plain.given, other.given, copy.of);
      if (!asked.substep) continue;
      other.after.position = ordered(other.after.position, copy.of);
      other.after.velocity = ordered(other.after.velocity, copy.of);
      other.after = nearest_images(std::move(other.after), scene, images);
      widen(found.spread.after.position, found.plain.after.position, other.after.position);
      widen(found.spread.after.velocity, found.plain.after.velocity, other.after.velocity);
    }
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

  static Fields zeros(Eigen::Index fluid, Eigen::Index wall) {
    Fields all = Fields::unwritten(fluid, wall);
    each_real_field([&](const char*, auto member) { (all.*member).setZero(); });
    return all;
  }

  static bool is_of_walls(Eigen::VectorXd Fields::* member) { return member == &Fields::boundary_volume; }
  static bool is_of_walls(Eigen::Matrix3Xd Fields::*) { return false; }

  template <class Matrix>
  static Matrix ordered(const Matrix& values, const Order& of) {
    if constexpr (Matrix::ColsAtCompileTime == 1) return values(of);
    else return values(Eigen::all, of);
  }
  template <class Matrix>
  static void widen(Matrix& spread, const Matrix& values, const Matrix& other) {
    spread = spread.cwiseMax((other - values).cwiseAbs());
  }
  static void widen(Fields& spread, const Fields& values, const Fields& other, const Order& of) {
    each_real_field([&](const char*, auto member) {
      widen(spread.*member, values.*member, is_of_walls(member) ? other.*member : ordered(other.*member, of));
    });
  }

  Fields loaded(const Scene& scene, const Walls& walls, const ParticleState& state) {
    reference_.load(scene, walls, state);
    return fields(state.size(), walls.size(), nullptr);
  }

  /// The rest of an answer, at what is loaded.
  void answer(Answer& out, const StageInputs& inputs, Eigen::Index wall, Eigen::Index fluid, Asked asked) {
    if (asked.given) out.given = fields(fluid, wall, &inputs);
    if (asked.substep) out.after = advanced(1, fluid);
  }

  Fields fields(Eigen::Index fluid, Eigen::Index wall, const StageInputs* given) {
    Fields found = Fields::unwritten(fluid, wall);
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

/// Fields with their bounds, as reference_solution() has them.
ReferenceSolution bounded(const ReferenceSolution& geometry, const Fields& values, const Fields& spread) {
  ReferenceSolution found;
  found.fields = found.tolerance = values;
  each_real_field(
      [&](const char*, auto member) { found.tolerance.*member = tolerance_of(values.*member, spread.*member); });
  // Who is too near to H to be counted is a matter of geometry, whatever the formulas.
  found.fluid_ambiguous = geometry.fluid_ambiguous;
  found.wall_ambiguous = geometry.wall_ambiguous;
  found.most_fluid_ambiguous = geometry.most_fluid_ambiguous;
  found.most_wall_ambiguous = geometry.most_wall_ambiguous;
  return found;
}

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
  const Asked asked{wanted({"fields", "conservation"}) && (prepared.offers & Offer::given),
                    wanted({"substep"}) && (prepared.offers & Offer::step)};
  const Measured found = measuring.measured(scene, prepared.walls, fixture.state, asked);
  const ReferenceSolution geometry = reference_solution(scene, prepared.walls, fixture.state);
  prepared.own = bounded(geometry, found.plain.own, found.spread.own);
  prepared.inputs = found.inputs;
  if (asked.given) prepared.given = bounded(geometry, found.plain.given, found.spread.given);
  if (asked.substep) {
    const ParticleState& after = found.plain.after;
    prepared.substep.ambiguous.assign(static_cast<std::size_t>(after.size()), false);
    prepared.substep.outcomes = outcomes_of(after, tolerance_of(after.position, found.spread.after.position),
                                            tolerance_of(after.velocity, found.spread.after.velocity));
  }
  if (wanted({"invariance"}))
    for (TransformedProblem& problem : transformed_problems(scene, fixture.state)) {
      Walls walls = sample_walls(problem.scene);
      const Measured changed = measuring.measured(problem.scene, walls, problem.state);
      ReferenceSolution solution =
          bounded(reference_solution(problem.scene, walls, problem.state), changed.plain.own, changed.spread.own);
      prepared.transformed.push_back({std::move(problem), std::move(walls), std::move(solution)});
    }
  if (!(prepared.offers & Offer::step)) return prepared;
  if (wanted({"mass", "containment", "determinism"})) {
    prepared.segments = segments_of(fixture, sample_every);
    for (Segment& segment : prepared.segments) segment.viewed = false;
    reference.load(scene, prepared.walls, fixture.state);
    run_ahead(fixture, prepared, [&](int substeps) { return measuring.advanced(substeps, fixture.state.size()); });
  }
  return prepared;
}

}  // namespace decant
