/// \file
/// Which rows get a file, its name, and what it says about itself.
#include "tools/commands/reproducers.hpp"

#include "oracle/checks/neighborhood.hpp"
#include "oracle/files/fixture_file.hpp"
#include "oracle/report/console_table.hpp"
#include "tools/common/build_provenance.hpp"
#include "tools/common/file_name.hpp"
#include "tools/common/recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

namespace decant {
namespace {

std::string name_of(const CheckRow& row) {
  const std::string options = row.options.empty() ? "" : ":" + row.options;
  return fmt::format("{}-{}-{}-{}-{}.h5", plain_file_name(row.fixture), plain_file_name(row.backend + options),
                     plain_file_name(row.check), plain_file_name(row.field), row.worst_id);
}

bool can_be_cut_out(const CheckRow& row) {
  return verdict_of(row) == Verdict::fail && is_located(row) && (!is_of_walls(row) || row.fluid_neighbors > 0);
}

}  // namespace

std::vector<ReproducerFile> reproducers_of(const Report& report, const std::filesystem::path& folder) {
  std::vector<ReproducerFile> reproducers;
  std::map<std::pair<std::string, std::string>, std::size_t> known;  // place in `reproducers`
  for (std::size_t k = 0; k < report.rows.size(); ++k) {
    const CheckRow& row = report.rows[k];
    if (!can_be_cut_out(row)) continue;
    const ReproducerFile reproducer{k, folder / name_of(row)};
    const auto [found, fresh] = known.emplace(std::pair{backend_label(row), row.fixture}, reproducers.size());
    if (fresh) reproducers.push_back(reproducer);
    else if (ReproducerFile& first = reproducers[found->second];
             is_of_walls(report.rows[first.row]) && !is_of_walls(row))
      first = reproducer;
  }
  return reproducers;
}

std::string write_reproducer(const std::filesystem::path& file, const Fixture& fixture, const CheckRow& row,
                             std::string& warning) {
  Reproducer reproducer = reproducer_of(fixture, row, reproducer_radius * fixture.scene.support_radius());
  Fixture& f = reproducer.fixture;
  warning = record_answer(f, fixture.ensemble.substeps, fixture.ensemble.members);
  for (const auto& [key, value] : build_provenance()) f.provenance[key] = value;
  const std::string kind = is_of_walls(row) ? "wall particle" : "particle";
  f.provenance["cut_out_of"] = fixture.name + " " + fixture.sha256;
  f.provenance["cut_around"] = fmt::format(
      "{} {}{}", kind, row.worst_id, reproducer.particle < 0 ? "" : fmt::format(", here {}", reproducer.particle));
  f.provenance["cut_radius"] = fmt::format("{:g} H", reproducer_radius);
  f.provenance["cut_because"] = fmt::format("{}: {}, score {:.4g}", backend_label(row), check_label(row), row.score);
  write_fixture(file, f);
  return fmt::format("{}: the {} particles around {}", file.string(), f.state.size(), f.provenance["cut_around"]);
}

}  // namespace decant
