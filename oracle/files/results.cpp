/// \file
/// A results file of a fixture: which of its fields are there, whose they are, and their rows.
#include "oracle/files/results.hpp"

#include "oracle/checks/neighborhood.hpp"
#include "oracle/files/foreign_file.hpp"
#include "reference/sampling.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace decant {
namespace {

constexpr const char* own_group = "/fields";
constexpr const char* staged_group = "/staged";
constexpr const char* after_group = "/substep";

class ResultsReader {
 public:
  ResultsReader(const std::filesystem::path& file, const Fixture& fixture)
      : in_(open_foreign(file)), fixture_(fixture), n_(fixture.state.size()) {
    const std::int64_t schema = in_.integer_attribute("/", "decant_results");
    if (schema != results_schema) in_.fail("/@decant_results", std::to_string(schema), std::to_string(results_schema));
    require_fixture();
    const Eigen::Index walls = sample_walls(fixture.scene).size();
    results_.own_fields = results_.staged_fields = Fields::unwritten(n_, walls);
    if (in_.has_attribute("/", "device")) results_.device = in_.text_attribute("/", "device");
    rows_ = n_;
    if (!in_.has("/id")) return;
    const IdVector found = in_.integers("/id");
    rows_ = found.size();
    results_.has_ids = true;
    results_.ids = match_ids(IdVector::LinSpaced(n_, 0, n_ - 1), found);
  }

  Results read() {
    std::vector<std::string> own_names, staged_names;
    for (const auto& field : stage_fields) own_names.push_back(field.name);
    for (const auto& fact : neighbor_facts) own_names.push_back(fact.name);
    for (const auto& field : acceleration_fields) staged_names.push_back(field.name);
    own_names.insert(own_names.end(), staged_names.begin(), staged_names.end());
    require_known(own_group, own_names);
    staged_names.push_back("pressure");
    require_known(staged_group, staged_names);
    require_known(after_group, {"position", "velocity"});
    Fields& own = results_.own_fields;
    for (const auto& field : stage_fields) {
      const bool of_walls = field.member == &Fields::boundary_volume;
      take(own_group, field.name, field.unit, results_.own, [&](const std::string& path) {
        own.*field.member = of_walls ? in_.vector(path, own.boundary_volume.size()) : ordered(in_.vector(path, rows_));
      });
    }
    for (const auto& fact : neighbor_facts)
      take(own_group, fact.name, "", results_.own,
           [&](const std::string& path) { own.*fact.member = ordered(in_.integers(path, rows_)); });
    for (const auto& field : acceleration_fields) {
      const auto into = [&](Fields& fields) {
        return [&](const std::string& path) { fields.*field.member = ordered(in_.matrix3(path, rows_)); };
      };
      take(own_group, field.name, "m/s^2", results_.own, into(own));
      take(staged_group, field.name, "m/s^2", results_.staged, into(results_.staged_fields));
    }
    take(staged_group, "pressure", "Pa", results_.staged,
         [&](const std::string& path) { results_.staged_fields.pressure = ordered(in_.vector(path, rows_)); });
    ParticleState& after = results_.after_state;
    take(after_group, "position", "m", results_.after,
         [&](const std::string& path) { after.position = ordered(in_.matrix3(path, rows_)); });
    take(after_group, "velocity", "m/s", results_.after,
         [&](const std::string& path) { after.velocity = ordered(in_.matrix3(path, rows_)); });
    return std::move(results_);
  }

 private:
  void require_fixture() const {
    const bool by_digest = in_.has_attribute("/", "fixture_sha256");
    const bool by_number = in_.has_attribute("/", "particles");
    if (!by_digest && !by_number)
      in_.fail("/@fixture_sha256", "missing", "the fixture's SHA-256, or the number of its particles in /@particles");
    if (by_digest && in_.text_attribute("/", "fixture_sha256") != fixture_.sha256)
      in_.fail("/@fixture_sha256", in_.text_attribute("/", "fixture_sha256"),
               fmt::format("{}, that of {}", fixture_.sha256, fixture_.name));
    if (by_number && in_.integer_attribute("/", "particles") != n_)
      in_.fail("/@particles", std::to_string(in_.integer_attribute("/", "particles")),
               fmt::format("{}, as {} has", n_, fixture_.name));
  }

  /// A name that is spelled wrong would read as a field that was not given.
  void require_known(const std::string& group, const std::vector<std::string>& known) const {
    if (!in_.has(group)) return;
    for (const auto& name : in_.children(group))
      if (std::find(known.begin(), known.end(), name) == known.end())
        in_.fail(group + "/" + name, "unknown", fmt::format("one of {}", fmt::join(known, ", ")));
  }

  template <class Values>
  Values ordered(const Values& found) const {
    return results_.has_ids && results_.ids.ok() ? results_.ids.ordered(found) : found;
  }

  template <class Read>
  void take(const std::string& group, const char* name, const std::string& unit, Answered& given, const Read& read) {
    const std::string path = group + "/" + name;
    if (!in_.has(path)) return;
    if (in_.has_attribute(path, "unit") && in_.text_attribute(path, "unit") != unit)
      in_.fail(path + "@unit", in_.text_attribute(path, "unit"), unit.empty() ? "none" : unit);
    read(path);
    given.insert(name);
  }

  Hdf5Reader in_;
  const Fixture& fixture_;
  Eigen::Index n_, rows_ = 0;
  Results results_;
};

/// The row without its figures: what cannot be told apart by id is not judged value by value.
CheckRow untold(const CheckRow& row) {
  CheckRow plain;
  plain.backend = row.backend;
  plain.executor = row.executor;
  plain.device = row.device;
  plain.fixture = row.fixture;
  plain.check = row.check;
  plain.field = row.field;
  plain.unit = row.unit;
  plain.fp32_reference_score = row.fp32_reference_score;
  plain.reason = "the ids do not tell which particle is which";
  return plain;
}

}  // namespace

void check_ids(const Matching& ids, Eigen::Index expected, RowBuilder& builder) {
  CheckRow& row = builder.row("ids", "id", "1");
  compare(static_cast<double>(ids.faults), 0, row);
  row.n = expected;
  if (!ids.ok()) row.reason = ids.mismatch;
}

void CheckedResults::add(std::vector<CheckRow> rows) {
  for (CheckRow& row : rows) {
    const bool absent_one = row.verdict == Verdict::not_run && row.reason == not_given;
    (absent_one ? absent : given).push_back(std::move(row));
  }
}

const CheckSelection& results_checks() {
  static const CheckSelection checks{"fields", "substep", "conservation"};
  return checks;
}

Results read_results(const std::filesystem::path& file, const Fixture& fixture) {
  return ResultsReader(file, fixture).read();
}

CheckedResults run_checks(const Results& results, const std::string& name, const Fixture& fixture,
                          const PreparedReference& oracle, const CheckSelection& checks) {
  const BackendInfo info{name, "", "file", results.device, ""};
  RowBuilder builder(info, fixture.name);
  if (checks.count("fields")) {
    check_stages(results.own_fields, results.own, oracle, builder);
    check_staged(results.staged_fields, results.staged, oracle, builder);
    check_evaluation(results.own_fields, results.own, oracle, builder);
  }
  if (checks.count("substep")) check_substep(results.after_state, results.after, fixture, oracle, builder);
  if (checks.count("conservation")) check_momentum(results.staged_fields, results.staged, fixture, oracle, builder);
  std::vector<CheckRow> rows = builder.take();
  CheckedResults judged;
  if (results.has_ids) {
    RowBuilder ids(info, fixture.name);
    check_ids(results.ids, fixture.state.size(), ids);
    judged.add(ids.take());
    if (!results.ids.ok())
      for (CheckRow& row : rows)
        if (row.reason != not_given && row.check != "boundary_volume") row = untold(row);
  }
  locate(fixture, oracle.walls, rows);
  judged.add(std::move(rows));
  return judged;
}

}  // namespace decant
