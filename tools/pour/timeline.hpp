/// \file
/// What a pour was like over time: one row a frame, stage times at the end. The rows so far travel
/// in the checkpoint, so a resumed pour ends with the same timeline.
#pragma once

#include "oracle/backend.hpp"
#include "oracle/checks/audit.hpp"
#include "oracle/files/hdf5_io.hpp"
#include "reference/state.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace decant::pour {

/// One frame's row.
struct TimelineRow {
  std::int64_t frame = 0, substep = 0;
  double time = 0;                                               // s
  std::array<std::int64_t, region_names.size()> particles_at{};  // by Region
  std::array<double, region_names.size()> mass_at{};             // kg, by Region
  double kinetic_energy = 0, potential_energy = 0;               // J
  double max_speed = 0;                                          // m/s
  std::int64_t fastest_particle = -1, densest_particle = -1;     // of max_speed and max_density
  double min_density = 0, max_density = 0;                       // kg/m³
  double max_pressure = 0;                                       // Pa
  double deepest = 0;                                            // m, into a solid
  std::int64_t deepest_particle = -1, inside = 0, crossed = 0, first_crossed = -1;
  double solver_seconds = 0;  // s, wall time of advancing to this frame
  double wall_seconds = 0;    // s, wall time since the start, all sessions together
};

/// Whether no value is NaN or infinite, in one pass without a branch: their differences with themselves add up to 0.
template <class Values>
bool all_finite(const Values& values) {
  return (values - values).sum() == 0.0;
}

inline bool all_finite(const ParticleState& state) { return all_finite(state.position) && all_finite(state.velocity); }

/// Throws BackendError naming the particle where a density or a pressure is not finite.
void require_finite(const Fields& fields, std::int64_t substep);

/// The row of one state.
TimelineRow timeline_row(std::int64_t frame, const Scene& scene, const ParticleState& state, const Fields& fields,
                         const AuditResult& audit);

/// Wall times of one stage of the substep, added over sessions.
StageTimes operator+(const StageTimes& a, const StageTimes& b);
/// Those since an earlier moment.
StageTimes operator-(const StageTimes& now, const StageTimes& before);

/// Stage names and members, in the order they run.
struct StageName {
  const char* name;
  StageTimes::Stage StageTimes::* stage;
};
inline constexpr std::array<StageName, 4> stage_names = {{{"build", &StageTimes::build},
                                                          {"density", &StageTimes::density},
                                                          {"force", &StageTimes::force},
                                                          {"integrate", &StageTimes::integrate}}};

/// Rows of a whole pour.
struct Timeline {
  std::vector<TimelineRow> rows;
  StageTimes stages;

  /// Writes a dataset a column and the stage times into a group ("" is the root).
  void write(Hdf5Writer& out, const std::string& group) const;
  /// Reads what `write` wrote. Throws InputError naming file and dataset.
  static Timeline read(const Hdf5Reader& in, const std::string& group);
};

/// timeline.h5: all columns and the scene, written whole. Throws std::runtime_error naming the
/// file. \param texts  attributes of the root
void write_timeline(const std::filesystem::path& file, const Timeline& timeline, const std::string& scene_json,
                    const std::map<std::string, std::string>& texts);

/// What the rows say in the end.
struct Summary {
  std::int64_t particles = 0, frames = 0, substeps = 0;
  std::array<double, region_names.size()> mass_at{};               // kg, at the end
  std::array<double, region_names.size()> fraction_at{};           // of the whole mass
  double mass = 0;                                                 // kg
  std::int64_t unbalanced_frames = 0;                              // frames whose places do not add up to all particles
  std::int64_t frames_inside = 0;                                  // frames with particles inside a solid
  std::int64_t crossings = 0;                                      // particles seen crossing a wall, over all frames
  double deepest = 0;                                              // m
  std::int64_t penetration_frame = -1, penetration_particle = -1;  // the first one; −1: none
  double final_kinetic_energy = 0, peak_kinetic_energy = 0, peak_kinetic_time = 0;  // J, J, s
  double max_speed = 0, max_density = 0;                                            // m/s, kg/m³; over all frames
  double solver_seconds = 0, wall_seconds = 0;                                      // s
  double seconds_per_substep = 0;                                                   // s, of the solver alone

  bool balanced() const { return unbalanced_frames == 0; }
  bool penetrated() const { return penetration_frame >= 0; }
};

/// \param mass  kg, of one particle
Summary summarise(const Timeline& timeline, std::int64_t particles, double mass);

}  // namespace decant::pour
