/// \file
/// Rows, reproducers and provenance by name.
#include "tools/commands/report_json.hpp"

#include <nlohmann/json.hpp>

namespace decant {

std::string json_text(const Report& report, const std::vector<ReproducerFile>& reproducers, const std::string& line,
                      int status) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array(), files = rows;
  for (const auto& r : report.rows)
    rows.push_back({{"backend", r.backend},
                    {"options", r.options},
                    {"executor", r.executor},
                    {"device", r.device},
                    {"fixture", r.fixture},
                    {"check", r.check},
                    {"field", r.field},
                    {"unit", r.unit},
                    {"n", r.n},
                    {"error", r.error},
                    {"tolerance", r.tolerance},
                    {"score", r.score},
                    {"median_score", r.median_score},
                    {"fp32_reference_score", r.fp32_reference_score},
                    {"worst_id", r.worst_id},
                    {"worst_component", r.worst_component},
                    {"actual", r.actual},
                    {"expected", r.expected},
                    {"worst_position", {r.worst_x, r.worst_y, r.worst_z}},
                    {"fluid_neighbors", r.fluid_neighbors},
                    {"wall_neighbors", r.wall_neighbors},
                    {"nearest", r.nearest},
                    {"excluded", r.excluded},
                    {"verdict", to_string(verdict_of(r))},
                    {"reason", reason_of(r)}});
  for (const auto& reproducer : reproducers)
    files.push_back({{"row", reproducer.row}, {"file", reproducer.file.string()}});
  const nlohmann::ordered_json all = {{"summary", line},
                                      {"exit_status", status},
                                      {"rows", rows},
                                      {"reproducers", files},
                                      {"provenance", report.provenance}};
  return all.dump(2);
}

}  // namespace decant
