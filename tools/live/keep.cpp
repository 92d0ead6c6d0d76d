/// \file
/// The recording is written as `decant record` writes it, and read again before it is judged.
#include "tools/live/keep.hpp"

#include "oracle/checks/conform.hpp"
#include "oracle/files/fixture_file.hpp"
#include "oracle/report/report.hpp"
#include "tools/common/recording.hpp"

#include <fmt/format.h>

#include <cmath>

namespace decant::live {
namespace fs = std::filesystem;

Kept keep_instant(const Instant& instant, const fs::path& folder) {
  constexpr Eigen::Index study_scale = 20'000;
  const bool sample = instant.state.size() > study_scale;
  Fixture fixture;
  fixture.phase = "live";
  fixture.scene = instant.scene;
  fixture.state = instant.state;
  // As long and as many as `decant record` has them, or the fewest: two clicks do not wait for hours.
  const std::string why = record_answer(fixture, sample ? 1 : 32, sample ? 2 : 24);
  if (sample) reduce_to_sample(fixture);
  fixture.provenance = recording_provenance(instant.info, "an instant of decant live");
  fs::create_directories(folder);
  const std::string stem =
      fmt::format("{}-live-{}", instant.scene.name.empty() ? "scene" : instant.scene.name, instant.state.substep);
  fs::path file = folder / (stem + ".h5");
  for (int k = 2; fs::exists(file); ++k) file = folder / fmt::format("{}-{}.h5", stem, k);
  write_fixture(file.string(), fixture);
  return {file, why};
}

nlohmann::ordered_json judge(const fs::path& file, Backend& backend) {
  const Fixture fixture = read_fixture(file.string());
  Report report;
  report.rows = run_checks(backend, fixture, prepare_reference(fixture));
  nlohmann::ordered_json out = {{"verdict", exit_status(report) == 0 ? "pass" : "fail"}};
  auto& rows = out["rows"] = nlohmann::ordered_json::array();
  for (const CheckRow& row : report.rows) {
    if (is_left_out(row)) continue;
    rows.push_back({{"check", row.check}, {"field", row.field}, {"verdict", to_string(verdict_of(row))}});
    auto& last = rows.back();
    // JSON has no infinity.
    if (std::isfinite(row.score)) last["score"] = row.score;
    if (const std::string reason = reason_of(row); !reason.empty()) last["reason"] = reason;
  }
  return out;
}

}  // namespace decant::live
