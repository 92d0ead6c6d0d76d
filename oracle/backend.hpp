/// \file
/// The interface every solver under test offers, the oracle's own adapter included. No Eigen here,
/// so that device code can include it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

namespace decant {

struct Scene;
struct Walls;
struct ParticleState;
struct Fields;
struct StageInputs;
struct Neighbors;

struct BackendInfo {
  std::string name;       // "brute"
  std::string options;    // as given on the command line; empty: defaults
  std::string executor;   // "reference", "host" or "cuda"
  std::string device;     // what the executor runs on
  std::string precision;  // "fp32" or "fp64"
};

/// Errors met on the way. A status that is not ok makes every result of the backend unusable.
struct Status {
  enum Bit : std::uint32_t { non_finite = 1, escaped = 2, capacity = 4, missed_pair = 8 };
  std::uint32_t bits = 0;
  std::int64_t particle = -1;  // smallest id concerned
  std::int64_t substep = -1;   // first substep it was seen after

  bool ok() const { return bits == 0; }
};

/// "non-finite value, particle 17, substep 2041"; "ok" without trouble.
std::string describe(const Status& status);

/// Seconds spent and number of passes timed, per stage of a substep, since `load`. A backend may time
/// some substeps and not others. Integration in one pass with the forces is part of their time.
struct StageTimes {
  struct Stage {
    double seconds = 0;
    std::int64_t calls = 0;
  };
  Stage build, density, force, integrate;
};

/// Pairs within H, both directions of fluid pairs, and those that lists lacked; summed over substeps.
struct PairTotals {
  std::int64_t pairs = 0, missed = 0, wall_pairs = 0, wall_missed = 0;
};

/// How ranks share the particles, since `load`.
struct RankStats {
  std::int64_t ghosts = 0;       // copies of other ranks' particles that there are now
  std::int64_t migrations = 0;   // moments at which particles changed ranks and ghosts were chosen
  std::int64_t rebalances = 0;   // and the ranks' boxes as well
  double largest_imbalance = 1;  // most particles of a rank by their mean, at the migrations since the first
};

struct NeighborStats {
  std::int64_t rebuilds = 0;             // since `load`
  std::int64_t device_bytes = 0;         // memory held; 0: not told
  double mean_fluid = 0, mean_wall = 0;  // neighbors a particle at the last evaluation
  RankStats ranks;                       // of one rank: as it is here
  PairTotals verified;                   // of lists that verify themselves, since `load`
};

/// What a backend can be asked for, or'ed; the bits of decant_offer (oracle/plugin.h). Checks of what is not offered
/// are not_run.
namespace Offer {
enum Bit : std::uint32_t {
  density = 1,       // and pressure
  acceleration = 2,  // the sum
  parts = 4,         // of it
  neighbors = 8,
  given = 16,  // StageInputs
  boundary_volume = 32,
  walls = 64,  // scenes with wall particles
  step = 128,  // advance and read
  status = 256,
  all = 511,      // that checks need
  lists = 512,    // Backend::lists
  rebuild = 1024  // options rebuild=N:skin=S
};
}  // namespace Offer

class Backend {
 public:
  virtual ~Backend() = default;
  virtual BackendInfo info() const = 0;
  virtual std::uint32_t offers() const { return Offer::all; }
  /// Takes scene, wall particles and state; may allocate. May be called again.
  virtual void load(const Scene&, const Walls&, const ParticleState&) = 0;
  /// Fields at the state, after `advance` from what its next substep would use; no later run changes by it. `out`
  /// arrives as Fields::unwritten. Later stages use `given`; out.pressure is always that of the density in use.
  [[nodiscard]] virtual Status evaluate(Fields& out, const StageInputs* given = nullptr) = 0;
  /// Density and pressure of `evaluate`; the other fields need not be written. For a pour, which asks at each frame.
  [[nodiscard]] virtual Status evaluate_density(Fields& out) { return evaluate(out); }
  /// `substeps` × dt onward.
  [[nodiscard]] virtual Status advance(int substeps) = 0;
  /// State in id order.
  virtual void read(ParticleState& out) const = 0;
  virtual StageTimes stage_times() const = 0;
  virtual NeighborStats neighbor_stats() const = 0;
  /// The lists that the next substep uses, ascending; the substep of the state that they were built at. Throws
  /// BackendError where `offers` lacks them.
  virtual std::int64_t lists(Neighbors& out) const;
};

}  // namespace decant
