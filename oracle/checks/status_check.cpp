/// \file
/// States with one thing wrong, and what has to be said of them.
#include "oracle/checks/status_check.hpp"

#include "oracle/solution/force_free.hpp"
#include "reference/state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <string>

namespace decant {
namespace {

constexpr const char* axis_names = "xyz";

/// How many reports of one kind were asked for, and what was wrong with the first that was.
struct Counted {
  std::int64_t asked = 0, wrong = 0;
  std::string first;

  void add(const std::string& what, const Status& got, const Status& expected) {
    ++asked;
    const bool right = got.bits == expected.bits &&
                       (expected.ok() || (got.particle == expected.particle && got.substep == expected.substep));
    if (right || wrong++ > 0) return;
    first = fmt::format("{}: {}; should be {}", what, describe(got), describe(expected));
  }
};

class Provoked {
 public:
  Provoked(Backend& backend, const Scene& scene, std::int64_t substep) : backend_(backend), scene_(force_free(scene)) {
    scene_.containers.clear();
    scene_.floor.reset();
    const Domain& domain = scene_.domain;
    const Vec3 size = domain.max - domain.min;
    Eigen::Index longest;
    size.maxCoeff(&longest);
    // In a row along the longest axis, out of each other's reach.
    const auto n =
        static_cast<Eigen::Index>(std::clamp(std::floor(size[longest] / (1.5 * scene_.support_radius())), 1.0, 5.0));
    state_.substep = substep;
    state_.position = (domain.min + 0.5 * size).replicate(1, n);
    for (Eigen::Index i = 0; i < n; ++i)
      state_.position(longest, i) =
          domain.min[longest] + (static_cast<double>(i) + 0.5) / static_cast<double>(n) * size[longest];
    state_.velocity.setZero(3, n);
    state_.quantise();
    id_ = std::max<Eigen::Index>(0, n - 2);
  }

  void nothing(Counted& counted) {
    counted.add("nothing wrong, evaluated", evaluated(state_), {});
    counted.add("nothing wrong, run", run(state_), {});
  }

  void escapes(Counted& counted) {
    for (int axis = 0; axis < 3; ++axis) {
      if (scene_.domain.periodic[static_cast<std::size_t>(axis)]) continue;
      for (const bool upper : {false, true}) {
        const std::string face = fmt::format("{}{}", upper ? '+' : '-', axis_names[axis]);
        ParticleState one = state_;
        leaves(one, id_, axis, upper, 2);
        counted.add("out through " + face, run(one), reported(Status::escaped, id_, 2));
        if (state_.size() < 3) continue;
        ParticleState two = state_;
        leaves(two, id_, axis, upper, 2);
        leaves(two, 0, axis, upper, 2);
        counted.add("two at once out through " + face, run(two), reported(Status::escaped, 0, 2));
        two = state_;
        leaves(two, id_, axis, upper, 2);
        leaves(two, 0, axis, upper, 3);
        counted.add("one after the other out through " + face, run(two), reported(Status::escaped, id_, 2));
      }
    }
  }

  void non_finite(Eigen::Matrix3Xd ParticleState::* member, bool evaluates, Counted& counted) {
    for (int axis = 0; axis < 3; ++axis)
      for (const double value : {std::nan(""), infinity, -infinity}) {
        ParticleState state = state_;
        (state.*member)(axis, id_) = value;
        const std::string what = fmt::format("{} = {}", axis_names[axis], value);
        refusable(counted, [&] { counted.add(what + ", run", run(state), reported(Status::non_finite, id_, 1)); });
        if (!evaluates || !std::isnan(value)) continue;
        refusable(counted,
                  [&] { counted.add(what + ", evaluated", evaluated(state), reported(Status::non_finite, id_, 0)); });
      }
  }

 private:
  Status reported(Status::Bit bit, Eigen::Index id, int after) const { return {bit, id, state_.substep + after}; }
  /// So that the particle is outside for the first time so many substeps on.
  void leaves(ParticleState& state, Eigen::Index id, int axis, bool upper, int after) const {
    const Domain& domain = scene_.domain;
    const double face = upper ? domain.max[axis] : domain.min[axis], out = upper ? 1 : -1;
    // A way that fp32 can tell out there.
    const double way = std::max(0.1 * scene_.particle_spacing, 0x1p-18 * std::abs(face));
    state.position(axis, id) = face - out * (after - 0.5) * way;
    state.velocity(axis, id) = out * way / scene_.time_step();
    state.quantise();
  }
  Status run(const ParticleState& state) {
    backend_.load(scene_, {}, state);
    return backend_.advance(3);
  }
  Status evaluated(const ParticleState& state) {
    backend_.load(scene_, {}, state);
    Fields fields = Fields::unwritten(state.size(), 0);
    return backend_.evaluate(fields);
  }
  template <class Ask>
  static void refusable(Counted& counted, Ask ask) {
    try {
      ask();
    } catch (const std::exception&) {
      ++counted.asked;  // refused: nobody can take it for a result
    }
  }

  Backend& backend_;
  Scene scene_;
  ParticleState state_;
  Eigen::Index id_ = 0;
};

}  // namespace

void check_status(Backend& backend, const Scene& scene, std::int64_t substep, RowBuilder& builder) {
  Provoked provoked(backend, scene, substep);
  Counted none, escaped, position, velocity;
  provoked.nothing(none);
  provoked.escapes(escaped);
  provoked.non_finite(&ParticleState::position, true, position);
  provoked.non_finite(&ParticleState::velocity, false, velocity);
  const auto row = [&](const char* field, const Counted& counted) {
    CheckRow& r = builder.row("status", field, "1");
    compare(static_cast<double>(counted.wrong), 0, r);
    r.n = counted.asked;
    if (counted.wrong > 0) r.reason = fmt::format("{} of {} reports; {}", counted.wrong, counted.asked, counted.first);
  };
  row("none", none);
  row("escaped", escaped);
  row("position", position);
  row("velocity", velocity);
}

}  // namespace decant
