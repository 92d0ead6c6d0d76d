/// \file
/// Adapter from Solver to Backend, with the same checks after each substep that a device does.
#include "oracle/solution/reference_backend.hpp"

#include "reference/error.hpp"
#include "reference/solver.hpp"

#include <cmath>
#include <optional>

namespace decant {
namespace {

class ReferenceBackend : public Backend {
 public:
  explicit ReferenceBackend(NeighborSearch search) : search_(search) {}

  BackendInfo info() const override {
    return {"reference", search_ == NeighborSearch::all_pairs ? "all-pairs" : "", "reference", "1 CPU core", "fp64"};
  }

  void load(const Scene& scene, const Walls& walls, const ParticleState& state) override {
    scene_ = scene;
    solver_.emplace(scene, walls, state, search_);
  }

  Status evaluate(Fields& out, const StageInputs* given) override {
    // Cells cannot be found for a position that is no number.
    if (const Status status = check(); !status.ok()) return status;
    solver().fields(out, given);
    return {};
  }

  Status advance(int substeps) override {
    // A position that is no number has no cell.
    if (substeps > 0)
      if (Status status = check(); status.bits & Status::non_finite) {
        ++status.substep;
        return status;
      }
    for (int k = 0; k < substeps; ++k) {
      solver().substep();
      if (const Status status = check(); !status.ok()) return status;
    }
    return {};
  }

  void read(ParticleState& out) const override { out = solver_.value().state(); }
  StageTimes stage_times() const override { return {}; }

  NeighborStats neighbor_stats() const override {
    NeighborStats stats;
    const auto& near = solver_.value().neighbors();
    for (const auto& list : near.fluid) stats.mean_fluid += static_cast<double>(list.size());
    for (const auto& list : near.wall) stats.mean_wall += static_cast<double>(list.size());
    const double n = std::max<double>(1, static_cast<double>(near.fluid.size()));
    stats.mean_fluid /= n;
    stats.mean_wall /= n;
    return stats;
  }

 private:
  Solver& solver() {
    if (!solver_) throw BackendError("reference: nothing is loaded");
    return *solver_;
  }

  Status check() {
    const ParticleState& s = solver().state();
    for (Eigen::Index i = 0; i < s.size(); ++i) {
      if (!s.position.col(i).allFinite() || !s.velocity.col(i).allFinite()) return {Status::non_finite, i, s.substep};
      for (int a = 0; a < 3; ++a)
        if (!scene_.domain.periodic[a] &&
            !(s.position(a, i) >= scene_.domain.min[a] && s.position(a, i) <= scene_.domain.max[a]))
          return {Status::escaped, i, s.substep};
    }
    return {};
  }

  NeighborSearch search_;
  Scene scene_;
  std::optional<Solver> solver_;
};

}  // namespace

std::unique_ptr<Backend> make_reference_backend(NeighborSearch search) {
  return std::make_unique<ReferenceBackend>(search);
}

std::int64_t Backend::lists(Neighbors&) const { throw BackendError(info().name + " does not offer its lists"); }

std::string describe(const Status& status) {
  if (status.ok()) return "ok";
  std::string what;
  const auto add = [&](std::uint32_t bit, const char* name) {
    if (status.bits & bit) what += (what.empty() ? "" : " and ") + std::string(name);
  };
  add(Status::non_finite, "non-finite value");
  add(Status::escaped, "particle outside the domain");
  add(Status::capacity, "neighbor capacity exceeded");
  add(Status::missed_pair, "pair missed by a neighbor list");
  return what + ", particle " + std::to_string(status.particle) + ", substep " + std::to_string(status.substep);
}

}  // namespace decant
