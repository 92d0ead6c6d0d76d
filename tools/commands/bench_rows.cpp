/// \file
/// Rows to JSON, HDF5 and text.
#include "tools/commands/bench_rows.hpp"

#include "oracle/files/file_aside.hpp"
#include "oracle/files/hdf5_io.hpp"
#include "oracle/report/console_table.hpp"
#include "tools/common/build_provenance.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace decant {
namespace {

nlohmann::ordered_json to_json(const BenchRow& row) {
  nlohmann::ordered_json stages = nullptr;
  if (row.tells_stages)
    for (std::size_t s = 0; s < bench_stage_names.size(); ++s) stages[bench_stage_names[s]] = row.stages_us[s];
  return {{"backend", row.backend},
          {"options", row.options},
          {"executor", row.executor},
          {"device", row.device},
          {"particles", row.particles},
          {"window", row.window},
          {"substep_us", row.substep_us},
          {"stages_us", stages},
          {"neighbors_mean", row.neighbors_mean},
          {"interactions_per_s", row.interactions_per_s()},
          {"conformant", row.conformant},
          {"wall_particles", row.wall_particles},
          {"substeps", row.substeps},
          {"fastest_us", row.fastest_us},
          {"slowest_us", row.slowest_us},
          {"substeps_per_rebuild", row.substeps_per_rebuild},
          {"device_bytes_per_particle", row.device_bytes_per_particle}};
}

}  // namespace

std::string backend_label(const std::string& name, const std::string& options) {
  return name + (options.empty() ? "" : ":" + options);
}

std::string bench_heading() {
  return fmt::format("{:<28} {:<9} {:>9} {:<10} {:>11} {:>9} {:>8} {:>7}  {}", "backend", "executor", "particles",
                     "window", "us/substep", "particle", "rebuilt", "bytes", "us by stage") +
         fmt::format("\n{:<60} {:>10} {:>9} {:>8} {:>7}", "", "", "substeps/s", "every", "each");
}

std::string to_text(const BenchRow& row) {
  std::string stages;
  if (row.tells_stages)
    for (std::size_t s = 0; s < bench_stage_names.size(); ++s)
      stages += fmt::format(" {} {:.1f}", bench_stage_names[s], row.stages_us[s]);
  return fmt::format(
      "{:<28} {:<9} {:>9} {:<10} {:>11.2f} {:>9.3g} {:>8} {:>7} {}", backend_label(row.backend, row.options),
      row.executor, row.particles, row.window, row.substep_us, row.particle_substeps_per_s(),
      row.substeps_per_rebuild > 0 ? fmt::format("{:.2f}", row.substeps_per_rebuild) : "-",
      row.device_bytes_per_particle > 0 ? fmt::format("{:.0f}", row.device_bytes_per_particle) : "-", stages);
}

std::string bench_json(const std::vector<BenchRow>& rows, const std::string& interrupted) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array(), made_by;
  for (const BenchRow& row : rows) list.push_back(to_json(row));
  for (const auto& [key, value] : build_provenance()) made_by[key] = value;
  nlohmann::ordered_json all = {{"decant_bench", 1}, {"rows", list}, {"provenance", made_by}};
  if (!interrupted.empty()) all["interrupted"] = interrupted;
  return all.dump(2) + '\n';
}

void write_bench_hdf5(const std::string& file, const std::vector<BenchRow>& rows, const std::string& interrupted) {
  Hdf5Writer out(file);
  out.attribute("/", "decant_bench", 1);
  if (!interrupted.empty()) out.attribute("/", "interrupted", interrupted);
  const auto n = static_cast<Eigen::Index>(rows.size());
  const auto text = [&](const char* name, auto get, const char* description) {
    std::vector<std::string> values;
    for (const BenchRow& row : rows) values.push_back(get(row));
    out.strings(std::string("/rows/") + name, values, description);
  };
  const auto real = [&](const std::string& name, auto get, const char* unit, const char* description) {
    Eigen::VectorXd values(n);
    for (Eigen::Index k = 0; k < n; ++k) values[k] = get(rows[static_cast<std::size_t>(k)]);
    out.vector("/rows/" + name, values, unit, description);
  };
  const auto whole = [&](const char* name, auto get, const char* description) {
    IdVector values(n);
    for (Eigen::Index k = 0; k < n; ++k) values[k] = get(rows[static_cast<std::size_t>(k)]);
    out.integers(std::string("/rows/") + name, values, description);
  };
  text("backend", [](const BenchRow& r) { return r.backend; }, "name");
  text("options", [](const BenchRow& r) { return r.options; }, "as given; empty: defaults");
  text("executor", [](const BenchRow& r) { return r.executor; }, "cuda, host or reference");
  text("device", [](const BenchRow& r) { return r.device; }, "what the executor ran on");
  text("window", [](const BenchRow& r) { return r.window; }, "phase of the pour");
  whole("particles", [](const BenchRow& r) { return r.particles; }, "fluid");
  whole("wall_particles", [](const BenchRow& r) { return r.wall_particles; }, "of all containers");
  whole("substeps", [](const BenchRow& r) { return r.substeps; }, "in a window");
  whole(
      "conformant", [](const BenchRow& r) { return std::int64_t{r.conformant}; }, "1: judged on the state and passed");
  real("substep_us", [](const BenchRow& r) { return r.substep_us; }, "us", "median window");
  real("fastest_us", [](const BenchRow& r) { return r.fastest_us; }, "us", "fastest window");
  real("slowest_us", [](const BenchRow& r) { return r.slowest_us; }, "us", "slowest window");
  for (std::size_t s = 0; s < bench_stage_names.size(); ++s)
    real(
        std::string("stage_") + bench_stage_names[s] + "_us",
        [s](const BenchRow& r) { return r.tells_stages ? r.stages_us[s] : std::nan(""); }, "us",
        "share of a substep; NaN: not told");
  real(
      "neighbors_mean", [](const BenchRow& r) { return r.neighbors_mean; }, "1",
      "fluid and wall neighbors per particle");
  real(
      "interactions_per_s", [](const BenchRow& r) { return r.interactions_per_s(); }, "1/s",
      "neighbors found per second");
  real("substeps_per_rebuild", [](const BenchRow& r) { return r.substeps_per_rebuild; }, "1", "0: not told");
  real("device_bytes_per_particle", [](const BenchRow& r) { return r.device_bytes_per_particle; }, "B", "0: not told");
  for (const auto& [key, value] : build_provenance()) out.attribute("/provenance", key, value);
  out.commit();
}

}  // namespace decant
