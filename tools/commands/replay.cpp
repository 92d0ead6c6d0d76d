/// \file
/// Which rows get a file, its name, and what it says about itself.
#include "tools/commands/replay.hpp"

#include "oracle/checks/surroundings.hpp"
#include "oracle/files/fixture_file.hpp"
#include "oracle/report/console_table.hpp"
#include "tools/common/build_provenance.hpp"
#include "tools/common/recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

namespace decant {
namespace {

/// Letters, digits and "._-" stay; everything else becomes a dash.
std::string plain(std::string text) {
  for (char& c : text) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!letter && c != '.' && c != '_') c = '-';
  }
  return text;
}

std::string name_of(const CheckRow& row) {
  const std::string options = row.options.empty() ? "" : ":" + row.options;
  return fmt::format("{}-{}-{}-{}-{}.h5", plain(row.fixture), plain(row.backend + options), plain(row.check),
                     plain(row.field), row.worst_id);
}

bool can_be_replayed(const CheckRow& row) {
  return judged_verdict(row) == Verdict::fail && is_located(row) && (!is_of_walls(row) || row.fluid_neighbors > 0);
}

}  // namespace

std::vector<Replay> replays_of(const Report& report, const std::filesystem::path& folder) {
  std::vector<Replay> replays;
  std::map<std::pair<std::string, std::string>, std::size_t> known;  // place in `replays`
  for (std::size_t k = 0; k < report.rows.size(); ++k) {
    const CheckRow& row = report.rows[k];
    if (!can_be_replayed(row)) continue;
    const Replay replay{k, folder / name_of(row)};
    const auto [found, fresh] = known.emplace(std::pair{backend_label(row), row.fixture}, replays.size());
    if (fresh) replays.push_back(replay);
    else if (Replay& first = replays[found->second]; is_of_walls(report.rows[first.row]) && !is_of_walls(row))
      first = replay;
  }
  return replays;
}

std::string write_replay(const std::filesystem::path& file, const Fixture& fixture, const CheckRow& row,
                         std::string& warning) {
  Cut cut = cut_out(fixture, row, replay_radius * fixture.scene.support_radius());
  Fixture& f = cut.fixture;
  warning = record_answer(f, fixture.ensemble.substeps, fixture.ensemble.members);
  for (const auto& [key, value] : build_provenance()) f.provenance[key] = value;
  const std::string kind = is_of_walls(row) ? "wall particle" : "particle";
  f.provenance["cut_out_of"] = fixture.name + " " + fixture.sha256;
  f.provenance["cut_around"] =
      fmt::format("{} {}{}", kind, row.worst_id, cut.particle < 0 ? "" : fmt::format(", here {}", cut.particle));
  f.provenance["cut_radius"] = fmt::format("{:g} H", replay_radius);
  f.provenance["cut_because"] = fmt::format("{}: {}, score {:.4g}", backend_label(row), check_label(row), row.score);
  write_fixture(file, f);
  return fmt::format("{}: the {} particles around {}", file.string(), f.state.size(), f.provenance["cut_around"]);
}

}  // namespace decant
