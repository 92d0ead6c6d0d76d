/// \file
/// What an executor offers the host side of a backend: plain arrays in, plain arrays out. Knows
/// neither Eigen nor the scene, so that device code can implement it.
#pragma once

#include "gpu/core/device_scene.hpp"
#include "gpu/options.hpp"
#include "gpu/ranks/communicator.hpp"
#include "oracle/backend.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace decant::gpu {

/// Everything a solver needs to start.
struct Problem {
  Constants constants;
  Geometry geometry;
  Box region;  // of make_region
  WallSamples walls;
  std::vector<float> position, velocity;  // [N,3] row-major, m, m/s
  // Of one rank of several: how many particles there are, the ids of its rows, ascending, and the ranks' boxes.
  int particles = 0;
  std::vector<int> id{};
  std::vector<Box> rank_boxes{};
};

/// Rows of a rank's fields and states: which particle each is of, and whether it is this rank's own (1) or a ghost.
struct RankRows {
  std::vector<int> id;
  std::vector<unsigned char> owned;
};

/// Fields in id order, as state.hpp names them; vectors are [N,3] row-major.
struct HostFields {
  std::vector<float> boundary_volume, density, pressure;
  std::vector<float> pressure_acceleration, viscous_acceleration, wall_pressure_acceleration, wall_viscous_acceleration,
      acceleration;
  std::vector<std::int64_t> fluid_count, fluid_id_sum, wall_count, wall_id_sum;
};

/// Position and velocity, [N,3] row-major, m, m/s.
struct StateRows {
  std::span<const float> position, velocity;
};

/// Oracle's inputs for later stages; empty: not given. Pressure comes with density.
struct GivenInputs {
  std::vector<float> boundary_volume, density, pressure;
};

class DeviceSolver {
 public:
  virtual ~DeviceSolver() = default;
  virtual void load(const Problem& problem) = 0;
  /// Fields at the present state, from what an advance left in use; `poses` one a container.
  virtual Status evaluate(const std::vector<DevicePose>& poses, const GivenInputs& given, HostFields& out) = 0;
  /// Of these fields density and pressure alone.
  virtual Status evaluate_density(const std::vector<DevicePose>& poses, HostFields& out) = 0;
  /// `substeps` onward; `poses` holds substeps + 1 sets, the first at the present time.
  virtual Status advance(int substeps, const std::vector<DevicePose>& poses) = 0;
  /// State in id order, there until the next call.
  virtual StateRows read() = 0;
  virtual StageTimes stage_times() const = 0;
  /// Without the mean numbers of neighbors, which an evaluation tells.
  virtual NeighborStats neighbor_stats() const = 0;

  /// Makes it one of several ranks that share a problem; before `load`. From then on load, evaluate,
  /// evaluate_density and advance are called by all ranks together, a status is that of all of them, and fields and
  /// states are of the rank's own rows. Throws BackendError where a backend cannot.
  virtual void join(Communicator& ranks);
  virtual RankRows rank_rows() const { return {}; }
};

/// The names of the backends under test. A new one is a line here and a file in backends/ with its factory, for
/// both executors.
#define DECANT_BACKENDS(entry) entry(brute) entry(hash) entry(list)

/// Factories of one executor, and what it runs on.
#define DECANT_DECLARE(name) std::unique_ptr<DeviceSolver> make_##name(const SolverOptions& options);
namespace host {
DECANT_BACKENDS(DECANT_DECLARE)
std::string device();
std::string thrust_version();
}  // namespace host
namespace cuda {
DECANT_BACKENDS(DECANT_DECLARE)
/// Empty where no device can be used; `why_not` says why.
std::string device(std::string* why_not);
void start_profiler();
/// Of the calling thread: the device of a rank, the first again after the last.
void use_device(int rank);
}  // namespace cuda
#undef DECANT_DECLARE

}  // namespace decant::gpu
