/// \file
/// What a bench measured: one row a backend, state and window; as JSON, as HDF5, and on the console.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace decant {

/// Times of a substep by stage, µs. A list's build is spread over the substeps that reuse it.
inline constexpr std::array<const char*, 5> bench_stage_names = {"build", "density", "force", "integrate", "other"};

struct BenchRow {
  std::string backend, options, executor, device, window;
  std::int64_t particles = 0, wall_particles = 0, substeps = 0;
  double substep_us = 0;
  double fastest_us = 0, slowest_us = 0;  // of the windows
  bool tells_stages = false;
  std::array<double, bench_stage_names.size()> stages_us{};
  double neighbors_mean = 0;
  double substeps_per_rebuild = 0;       // 0: the backend does not say
  double device_bytes_per_particle = 0;  // 0: the backend does not say
  bool conformant = false;

  double interactions_per_s() const { return neighbors_mean * static_cast<double>(particles) / substep_us * 1e6; }
  double particle_substeps_per_s() const { return static_cast<double>(particles) / substep_us * 1e6; }
};

/// NAME or NAME:OPTIONS, as --backend takes it.
std::string backend_label(const std::string& name, const std::string& options);

/// Heading of the console's table, and a line of it.
std::string bench_heading();
std::string to_text(const BenchRow& row);

/// Rows and this build's provenance as JSON text.
std::string bench_json(const std::vector<BenchRow>& rows, const std::string& interrupted = {});

/// Appears whole or not at all and holds this build's provenance. Throws std::runtime_error naming the file where it
/// cannot be written.
/// Columns of equal length in /rows, units as attributes.
void write_bench_hdf5(const std::string& file, const std::vector<BenchRow>& rows, const std::string& interrupted = {});

}  // namespace decant
